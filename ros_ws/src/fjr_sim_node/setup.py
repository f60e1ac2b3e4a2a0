from setuptools import find_packages, setup

setup(
    name="fjr_sim_node",
    version="0.1.0",
    packages=find_packages(include=["fjr_sim_node*"]),
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/fjr_sim_node"]),
        ("share/fjr_sim_node", ["package.xml"]),
    ],
    install_requires=["setuptools"],
    extras_require={"test": ["pytest"]},
    entry_points={"console_scripts": ["fjr_sim_node = fjr_sim_node.__main__:main"]},
)
