"""How the robots of this project are driven, one module each."""
