"""Answers to queries, in the encoding in which they were asked."""

from contextlib import suppress

import zenoh
from google.protobuf.message import Message

from pneuarm.logs.schema.codec import encode, encoding_of, is_json


def answer(query: zenoh.Query, key: str, message: Message) -> None:
    """Answer as JSON a query in JSON, any other as protobuf; whoever asked may have gone."""
    asked = str(query.encoding)
    encoding = asked if is_json(asked) else encoding_of(message)
    with query, suppress(zenoh.ZError):
        query.reply(key, encode(message, encoding), encoding=encoding)
