"""What is seen: fields, colours and actors; it knows PyVista but no Qt."""
