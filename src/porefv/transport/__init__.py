"""Transport in the fluid of a packing: what diffuses through its pores, or is carried along by the flow."""
