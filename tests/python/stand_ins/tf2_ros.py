import json

from geometry_msgs.msg import TransformStamped
from rclpy.node import Node


class TransformBroadcaster:
    def __init__(self, node):
        assert isinstance(node, Node)

    def sendTransform(self, transform):  # noqa: N802: as in ROS 2
        assert type(transform) is TransformStamped
        print(json.dumps({"topic": "/tf", "message": transform.as_dict()}), flush=True)
