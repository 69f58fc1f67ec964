"""Closure of eyes and lips: blinks completed, lids and lips that meet and do not cross."""
