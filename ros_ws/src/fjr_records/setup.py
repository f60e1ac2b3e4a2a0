from setuptools import find_packages, setup

setup(
    name="fjr_records",
    version="0.1.0",
    packages=find_packages(include=["fjr_records*"]),
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/fjr_records"]),
        ("share/fjr_records", ["package.xml"]),
    ],
    install_requires=["setuptools"],
    extras_require={"test": ["pytest"]},
)
