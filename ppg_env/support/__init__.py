"""Support: validation, frozen records, atomic writes, statistics."""
