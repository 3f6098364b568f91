// Panels that others open: beside those which are there.
let open = () => {};

/** Says who opens panels. */
export const openedBy = (opener) => (open = opener);

/** Opens a panel with its options beside the others, such as a plot of one number. */
export const openPanel = (panel, options = {}) => open(panel, options);
