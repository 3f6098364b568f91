"""Reads definitions, a JSON object a line, and prints whether a description of each has the hash that rosbags computes."""

import hashlib
import json
import sys

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

for line in sys.stdin:
    line = json.loads(line)
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg("int32 sec\nuint32 nanosec", "builtin_interfaces/msg/Time"))
    store.register(get_types_from_msg(line["text"], line["name"]))
    own = "RIHS01_" + hashlib.sha256(line["description"].encode()).hexdigest()
    print(json.dumps([line["name"], own, store.hash_rihs01(line["name"])]))
