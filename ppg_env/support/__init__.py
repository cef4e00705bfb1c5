"""The ground floor: validation, frozen records, atomic writes, statistics."""
