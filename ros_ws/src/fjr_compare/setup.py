from setuptools import find_packages, setup

setup(
    name="fjr_compare",
    version="0.1.0",
    packages=find_packages(include=["fjr_compare*"]),
    package_data={"": ["*.css", "*.html", "*.js", "*.xml"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/fjr_compare"]),
        ("share/fjr_compare", ["package.xml"]),
    ],
    install_requires=["setuptools"],
    extras_require={"test": ["pytest"]},
)
