#!/usr/bin/env python3
"""Opens pages of a console, as far as it can tell, and reads what they are sent.

usage: pages.py LINK NUMBER

LINK is what the console has printed. It ends when it is told to.
"""

from __future__ import annotations

import asyncio
import json
import sys

import aiohttp


async def read(session: aiohttp.ClientSession, url: str, token: str, ready: asyncio.Event) -> None:
    """Reads what a page is sent, until the console ends."""
    async with session.ws_connect(
        f"{url}/live", headers={"Origin": url}, max_msg_size=0, compress=0
    ) as page:
        await page.send_str(json.dumps({"token": token}))
        async for _ in page:
            ready.set()


async def main() -> None:
    """Opens the pages, and says when all of them are sent something."""
    url, token = sys.argv[1].split("/#")
    ready = [asyncio.Event() for _ in range(int(sys.argv[2]))]
    async with aiohttp.ClientSession(connector=aiohttp.TCPConnector(limit=0)) as session:
        pages = [asyncio.ensure_future(read(session, url, token, one)) for one in ready]
        for one in ready:
            await one.wait()
        print(f"{len(ready)} pages are open", flush=True)
        await asyncio.gather(*pages)


if __name__ == "__main__":
    asyncio.run(main())
