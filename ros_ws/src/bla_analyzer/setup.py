from setuptools import find_packages, setup

setup(
    name="bla_analyzer",
    version="0.1.0",
    packages=find_packages(include=["bla_analyzer*"]),
    package_data={"": ["*.css", "*.html", "*.js", "*.xml"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/bla_analyzer"]),
        ("share/bla_analyzer", ["package.xml"]),
    ],
    install_requires=["setuptools"],
    extras_require={"test": ["pytest"]},
)
