from setuptools import find_packages, setup

setup(
    name="gap_diagnosis",
    version="0.1.0",
    packages=find_packages(include=["gap_diagnosis*"]),
    package_data={"": ["*.css", "*.html", "*.js", "*.xml"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/gap_diagnosis"]),
        ("share/gap_diagnosis", ["package.xml"]),
    ],
    install_requires=["setuptools"],
    extras_require={"test": ["pytest"]},
)
