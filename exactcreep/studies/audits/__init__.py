"""What a finished run claims, made again from its events and compared."""
