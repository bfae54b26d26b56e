"""The calls of the client, to await, by what they are about."""
