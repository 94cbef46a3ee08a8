"""What fuzz.py and fuzz_logs.py run: programs of the C that flies, and mutated logs."""
