// Motion of a map's view, which fits the world until a person moves it.
import { useEffect } from "/slate.js";
import { fit, pan, zoom } from "/map/view.js";

/** Functions that move the view in `state`: `fitBounds`, `drag` and `zoomAt`. */
export function useMotion(state, size, bounds, options, setOptions) {
  useEffect(() => {
    if (size && size.width > 0 && !state.isMoved) state.view = fit(bounds, size);
    state.isDirty = true;
  }, [size?.width, size?.height, bounds]);
  const endFollowing = () => {
    if (options.follow) setOptions({ follow: "" });
  };
  const fitBounds = () => {
    Object.assign(state, { view: fit(bounds, size), isMoved: false, isDirty: true });
    endFollowing();
  };
  // A point of the world stays under the pointer.
  const drag = (from, to) => {
    Object.assign(state, { view: pan(state.view, to[0] - from[0], to[1] - from[1]), isMoved: true });
    endFollowing();
  };
  const zoomAt = (left, top, factor) => {
    Object.assign(state, { view: zoom(state.view, size, left, top, factor), isMoved: true });
  };
  return { fitBounds, drag, zoomAt };
}
