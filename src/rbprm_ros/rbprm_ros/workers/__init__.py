"""Planning work in processes of its own."""
