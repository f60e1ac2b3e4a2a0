from setuptools import find_packages, setup

setup(
    name="bla_analyzer",
    version="0.1.0",
    packages=find_packages(include=["bla_analyzer*"]),
    package_data={"bla_analyzer": ["*.css", "*.html", "*.js"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/bla_analyzer"]),
        ("share/bla_analyzer", ["package.xml"]),
    ],
    # What package.xml cannot name, for rosdep has no key for it.
    install_requires=["setuptools", "plotly>=6"],
    extras_require={"test": ["pytest"]},
)
