from setuptools import find_packages, setup

setup(
    name="fjr_validation",
    version="0.1.0",
    packages=find_packages(include=["fjr_validation*"]),
    package_data={"": ["*.css", "*.html", "*.js", "*.xml"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/fjr_validation"]),
        ("share/fjr_validation", ["package.xml"]),
    ],
    install_requires=["setuptools"],
    extras_require={"test": ["pytest"], "dask": ["distributed>=2024.8"]},
)
