"""The paper's figures on real meshes, each drawn through the service's own pipeline."""
