from setuptools import find_packages, setup

setup(
    name="fjr_kit",
    version="0.1.0",
    packages=find_packages(include=["fjr_kit*"]),
    package_data={"": ["*.css", "*.html", "*.js", "*.xml"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/fjr_kit"]),
        ("share/fjr_kit", ["package.xml"]),
    ],
    # What package.xml cannot name, for rosdep has no key for it.
    install_requires=["setuptools"],
    extras_require={"test": ["pytest"], "dask": ["distributed>=2024.8"], "report": ["plotly>=6"]},
)
