"""Answers to queries, in the encoding in which they were asked."""

from contextlib import suppress

import zenoh
from google.protobuf.message import Message

from pneuarm.logs.schema.codec import encode, encoding_of, is_json


class Answer:
    """A message in the encodings in which it is asked for, each made once.

    So what a key costs hangs on how often it changes, not on how often it is asked for.
    """

    def __init__(self, message: Message) -> None:
        self._message = message
        self._payloads: dict[bool, bytes] = {}

    def give(self, query: zenoh.Query, key: str) -> None:
        """Answer as JSON a query in JSON, any other as protobuf; whoever asked may have gone."""
        asked = str(query.encoding)
        in_json = is_json(asked)
        encoding = asked if in_json else encoding_of(self._message)
        if in_json not in self._payloads:
            self._payloads[in_json] = encode(self._message, encoding)
        with query, suppress(zenoh.ZError):
            query.reply(key, self._payloads[in_json], encoding=encoding)
