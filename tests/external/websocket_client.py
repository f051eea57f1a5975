"""Receives poses by WebSocket and prints their sequence numbers and times as JSON.   websocket_client.py URL COUNT"""

import asyncio
import json
import sys

import websockets


async def main(url, count):
    seen = []
    async with websockets.connect(url) as poses:
        async for message in poses:
            pose = json.loads(message)
            if "stale" not in pose["flag_names"]:  # the last pose once more, if the machine pauses for half a second
                seen.append([pose["sequence"], pose["time_us"]])
            if len(seen) == count:
                break
    print(json.dumps(seen))


asyncio.run(main(sys.argv[1], int(sys.argv[2])))
