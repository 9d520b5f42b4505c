"""Why a value is what it is: the adjoint of the bake, its rays again, causes and remedies."""
