// Panels that other panels open.
let open = () => {};

/** Sets the function that opens panels. */
export const openedBy = (opener) => (open = opener);

/** Opens a panel with options beside the others, such as a plot of one number. */
export const openPanel = (panel, options = {}) => open(panel, options);
