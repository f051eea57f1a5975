#!/usr/bin/env python3
"""ROS 2 node: publishes the valid poses of tricoil as geometry_msgs/PoseWithCovarianceStamped and as transforms.

  python3 ros2_node.py --ros-args -p source:=serial:/dev/ttyACM0 -p tracker:=scaat

Parameters: source and tracker, as for tricoil.open(), with the half space of the sensor (serial:/dev/ttyACM0,hemisphere=1/0/0,confined);
frame_id: name of the source's coordinate frame. Topics: sensor_1/pose to
sensor_4/pose, and /diagnostics: the state of the source and the flags of each sensor. Transforms: from frame_id to sensor_1 to sensor_4.
"""

import collections

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
from rclpy.node import Node
from rclpy.time import Time
from tf2_ros import TransformBroadcaster

import tricoil


class TricoilNode(Node):
    def __init__(self):
        super().__init__("tricoil")
        parameter = lambda name, default: self.declare_parameter(name, default).value  # noqa: E731
        self.frame_id = parameter("frame_id", "tricoil_source")
        self.source = tricoil.open(parameter("source", "sim:hand,realtime=yes"), parameter("tracker", "scaat"))
        self.delays_ns = collections.deque(maxlen=1000)  # ROS time minus device time
        self.broadcaster = TransformBroadcaster(self)
        self.newest = {}  # pose by sensor
        self.heard_ns = self.due_ns = 0
        self.diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self.topics = [self.create_publisher(PoseWithCovarianceStamped, f"sensor_{n}/pose", 10) for n in range(1, 5)]

    def stamp(self, time_s):
        """ROS time of a device time. The pose with the shortest delay sets the difference of the clocks."""
        time_ns = round(1e9 * time_s)
        self.delays_ns.append(self.get_clock().now().nanoseconds - time_ns)
        return Time(nanoseconds=time_ns + min(self.delays_ns)).to_msg()

    def publish(self, pose):
        position = dict(zip("xyz", map(float, pose.position_m)))
        rotation = dict(zip("wxyz", map(float, pose.quaternion_wxyz)))  # from the sensor's frame to the source's
        message, transform = PoseWithCovarianceStamped(), TransformStamped()
        message.header.stamp = transform.header.stamp = self.stamp(pose.time_s)
        message.header.frame_id = transform.header.frame_id = self.frame_id
        transform.child_frame_id = f"sensor_{pose.sensor + 1}"
        for axis, value in position.items():
            setattr(message.pose.pose.position, axis, value)
            setattr(transform.transform.translation, axis, value)
        for axis, value in rotation.items():
            setattr(message.pose.pose.orientation, axis, value)
            setattr(transform.transform.rotation, axis, value)
        message.pose.covariance = pose.covariance.ravel()  # position, rotation about the axes of frame_id: the same order
        self.topics[pose.sensor].publish(message)
        self.broadcaster.sendTransform(transform)


    def diagnose(self, pose):
        """Publishes the states of source and sensors once per second and at each change. pose: None, or a new one."""
        now = self.get_clock().now()
        is_news = False
        if pose is not None:
            before = self.newest.get(pose.sensor)
            is_news = before is None or (before.valid, before.flags) != (pose.valid, pose.flags)
            self.newest[pose.sensor] = pose
            self.heard_ns = now.nanoseconds
        if now.nanoseconds < self.due_ns and not is_news:
            return
        self.due_ns = now.nanoseconds + 1_000_000_000
        is_silent = now.nanoseconds - self.heard_ns > 1_000_000_000
        array = DiagnosticArray()
        array.header.stamp = now.to_msg()
        array.status = [self.status("source", DiagnosticStatus.ERROR if is_silent else DiagnosticStatus.OK, self.source.status)]
        for sensor, newest in sorted(self.newest.items()):
            level = DiagnosticStatus.ERROR if is_silent or not newest.valid else DiagnosticStatus.WARN if newest.flags else DiagnosticStatus.OK
            array.status.append(self.status(f"sensor {sensor + 1}", level, "silent" if is_silent else str(newest.flags) or "tracking"))
        self.diagnostics.publish(array)

    @staticmethod
    def status(name, level, message):
        status = DiagnosticStatus()
        status.name, status.level, status.message = f"tricoil: {name}", level, message
        return status


def main():
    rclpy.init()
    node = TricoilNode()
    try:
        while rclpy.ok():
            pose = node.source.poll(0.01)
            node.diagnose(pose)
            if pose is not None and pose.valid:
                node.publish(pose)
            elif pose is not None:
                reasons = pose.flags.name.lower()
                node.get_logger().warning(f"sensor {pose.sensor + 1}: no valid pose: {reasons}", throttle_duration_sec=5)
            rclpy.spin_once(node, timeout_sec=0)
    except (KeyboardInterrupt, EOFError):  # EOFError: end of a simulation or recording
        pass
    finally:
        node.source.close()
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
