from glob import glob

from setuptools import find_packages, setup

setup(
    name="fjr_bringup",
    version="0.1.0",
    packages=find_packages(include=["fjr_bringup*"]),
    package_data={"": ["*.css", "*.html", "*.js", "*.xml"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/fjr_bringup"]),
        ("share/fjr_bringup", ["package.xml"]),
        ("share/fjr_bringup/launch", glob("launch/*.launch.py")),
        ("share/fjr_bringup/urdf", glob("urdf/*.urdf")),
        ("share/fjr_bringup/config", glob("config/*.*")),
        ("share/fjr_bringup/config/paper", glob("config/paper/*.yaml")),
    ],
    install_requires=["setuptools"],
    extras_require={"test": ["pytest"]},
)
