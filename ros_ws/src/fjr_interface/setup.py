from setuptools import find_packages, setup

setup(
    name="fjr_interface",
    version="0.1.0",
    packages=find_packages(include=["fjr_interface*"]),
    package_data={"": ["*.css", "*.html", "*.js", "*.xml"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/fjr_interface"]),
        ("share/fjr_interface", ["package.xml"]),
    ],
    # What package.xml cannot name, for rosdep has no key for it.
    install_requires=["setuptools", "lz4>=4", "mcap>=1.2", "zstandard>=0.22"],
    extras_require={"test": ["pytest"]},
)
