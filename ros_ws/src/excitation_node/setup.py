from setuptools import find_packages, setup

setup(
    name="excitation_node",
    version="0.1.0",
    packages=find_packages(include=["excitation_node*"]),
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/excitation_node"]),
        ("share/excitation_node", ["package.xml"]),
    ],
    install_requires=["setuptools"],
    extras_require={"test": ["pytest"]},
    entry_points={"console_scripts": ["excitation_node = excitation_node.__main__:main"]},
)
