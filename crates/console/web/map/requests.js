// Requests of a map's tools: places, commands of a mission, strokes.
import { degrees, fixed, Problem, word } from "/slate.js";
import { isTurned } from "/map/drag.js";
import { navigate, paint, sendTo, setPlace, shownPath } from "/map/edit.js";
import { remaining } from "/map/navigation.js";
import { MARKS } from "/map/tools.js";

/** Why a place is outside of the world; null if it is inside. */
function outside({ x, y }, bounds) {
  const { minimum, maximum } = bounds ?? {};
  if (!maximum || [x, y].every((at, axis) => at >= minimum[axis] && at <= maximum[axis])) return null;
  const ends = (axis) => `${fixed(minimum[axis], "m")} to ${fixed(maximum[axis], "m")}`;
  const reason = `the position is outside of the world: x from ${ends(0)}, y from ${ends(1)}`;
  return new Problem(422, reason, "choose a position in the world");
}

/** What a place is called once it is set. */
function spoken(tool, target, place) {
  const heading = isTurned(target, place) ? `, ${degrees(place.theta)}` : "";
  return `${tool === "pose" ? "Pose" : "Goal"}: x ${fixed(place.x, "m")}, y ${fixed(place.y, "m")}${heading}`;
}

/** Functions that request changes by the tool: `place`, `command` and `stroke`. */
export function requestsOf({ agent, scene, worldBounds }, { tool, target, mark, brush }, readings, change) {
  const value = (path) => readings.get(path)?.value;
  const place = (place, isLast = false) => {
    const problem = outside(place, worldBounds);
    if (problem) {
      return change("", () => {
        throw problem;
      });
    }
    const shown = shownPath(target);
    const before = shown && (value(shown)?.pose ?? value(shown));
    const words = spoken(tool, target, place);
    if (target.how !== "navigate") return change(words, () => setPlace(agent.name, target, place, before));
    const status = value(scene.missions.find(({ path }) => path === shown)?.status);
    // That a mission is a loop can't be restored.
    const goals = before && !before.is_loop ? remaining(before, status) : null;
    return change(words, () => sendTo(agent.name, target, place, goals, isLast));
  };
  const command = (command) =>
    change(`Goals: ${word(command).toLowerCase()}`, async () => void (await navigate(agent.name, target, command)));
  const stroke = (points) =>
    change(`Painted: ${MARKS[mark].toLowerCase()}`, () => paint(agent.name, target, points, brush, mark));
  return { place, command, stroke };
}
