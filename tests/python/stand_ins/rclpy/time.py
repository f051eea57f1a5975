from geometry_msgs.msg import Message


class TimeMessage(Message):
    FIELDS = {"sec": int, "nanosec": int}


class Time:
    def __init__(self, *, nanoseconds):
        assert isinstance(nanoseconds, int) and nanoseconds >= 0
        self.nanoseconds = nanoseconds

    def to_msg(self):
        message = TimeMessage()
        message.sec, message.nanosec = divmod(self.nanoseconds, 10**9)
        return message
