"""The calls of the client, blocking, by what they are about."""
