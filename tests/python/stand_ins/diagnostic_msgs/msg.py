from geometry_msgs.msg import Header, Message


class DiagnosticStatus(Message):
    OK, WARN, ERROR, STALE = b"\x00", b"\x01", b"\x02", b"\x03"
    FIELDS = {"level": bytes, "name": str, "message": str, "hardware_id": str, "values": list}


class DiagnosticArray(Message):
    FIELDS = {"header": Header, "status": list}
