from setuptools import find_packages, setup

setup(
    name="fjr_export",
    version="0.1.0",
    packages=find_packages(include=["fjr_export*"]),
    package_data={"": ["*.css", "*.html", "*.js", "*.xml"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/fjr_export"]),
        ("share/fjr_export", ["package.xml"]),
    ],
    install_requires=["setuptools"],
    extras_require={"test": ["pytest"]},
)
