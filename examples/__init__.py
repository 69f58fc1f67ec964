"""The example that ships with usdface: a stylised head, a take, and pictures of both."""
