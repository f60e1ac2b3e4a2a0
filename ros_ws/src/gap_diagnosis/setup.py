from setuptools import find_packages, setup

setup(
    name="gap_diagnosis",
    version="0.1.0",
    packages=find_packages(include=["gap_diagnosis*"]),
    package_data={"gap_diagnosis": ["*.html"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/gap_diagnosis"]),
        ("share/gap_diagnosis", ["package.xml"]),
    ],
    # What package.xml cannot name, for rosdep has no key for it.
    install_requires=["setuptools", "dask>=2024.8", "distributed>=2024.8"],
    extras_require={"test": ["pytest"]},
)
