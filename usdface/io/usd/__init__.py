"""Readers, writers and checks of USD stages and layers; types of pxr stay in here."""
