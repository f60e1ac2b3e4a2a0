"""The ROS graph as processes: started, conducted, recorded, talked to by hand."""
