from glob import glob

from setuptools import find_packages, setup

setup(
    name="fjr_cli",
    version="0.1.0",
    packages=find_packages(include=["fjr_cli*"]),
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/fjr_cli"]),
        ("share/fjr_cli", ["package.xml"]),
        ("share/fjr_cli/launch", glob("launch/*.launch.py")),
    ],
    install_requires=["setuptools"],
    extras_require={"test": ["pytest"]},
    entry_points={"console_scripts": ["fjr = fjr_cli.app:main"]},
)
