from setuptools import find_packages, setup

setup(
    name="controller_node",
    version="0.1.0",
    packages=find_packages(include=["controller_node*"]),
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/controller_node"]),
        ("share/controller_node", ["package.xml"]),
    ],
    install_requires=["setuptools"],
    extras_require={"test": ["pytest"]},
    entry_points={"console_scripts": ["controller_node = controller_node.__main__:main"]},
)
