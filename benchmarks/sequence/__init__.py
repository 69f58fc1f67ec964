"""`usdface sequence` on a made show: speed, what is done again, kills, many workers."""
