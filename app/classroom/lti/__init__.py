"""LTI 1.3: a learning platform (Moodle, Canvas, …) launches Kinboard and gets grades back.

`platforms` reads the operator's file, `launches` verifies what a platform's user brings, `keys` fetches a
platform's public keys, `services` signs what we answer and posts grades, `seats` keeps who sits where on behalf of
which platform, `passback` sends scores. All that is asked of platforms goes through `exchange`. Of a user we keep
the platform's opaque id and an alias, no address and no full name.

PyJWT does the cryptography. PyLTI1p3 and its successor were not taken: their check of a nonce does not use it up,
so a launch could be replayed, and they have adapters for Django and Flask only.
"""
