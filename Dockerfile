# ROS 2 Jazzy with this project beside it. NOT TESTED: it was written where no container can be built.
#   docker build -t fjr-rig .
#   docker run --rm -it --ipc=host fjr-rig make test-quick
FROM ros:jazzy-ros-base
RUN apt-get update && apt-get install -y --no-install-recommends \
      make python3-venv python3-pip \
      ros-jazzy-ros2bag ros-jazzy-rosbag2-storage-mcap ros-jazzy-robot-state-publisher \
    && rm -rf /var/lib/apt/lists/*
# The user that the image brings along.
WORKDIR /home/ubuntu/fjr-rig
COPY --chown=ubuntu:ubuntu . .
USER ubuntu
SHELL ["/bin/bash", "-c"]
# Any target of make installs everything first; this one writes little.
RUN source /opt/ros/jazzy/setup.bash && make test-quick PYTHON=/usr/bin/python3
RUN echo 'source /opt/ros/jazzy/setup.bash; source ~/fjr-rig/.venv/bin/activate' >> ~/.bashrc
CMD ["bash", "-i"]
