"""The ROS graph as processes: started, conducted, recorded, talked to by hand.

Begin with `graph_run` (`fjr run`: a campaign on the real nodes). `conductor` starts realizations
and notices nodes that end, `recorder` makes the bags, `domain` keeps campaigns apart, `composed`
is all three nodes in one process, `by_hand` the client of `fjr pause` and its like;
`hand_recorder` and `topic_recorder` are `fjr record`, `answers` asks nodes and waits for what they
say, `launching` helps the launch files.
"""
