// The tools of a map: the selected one, the target that it changes, and its brush.
import { useReading, useState } from "/slate.js";

/** States that a stroke gives to cells, with their titles. */
export const MARKS = { OCCUPIED: "Occupied", FREE: "Free", MEASURED: "As measured" };

/** Widths of the brush, m. */
export const BRUSHES = [0.1, 0.2, 0.4, 0.8];

/** The selected tool with its settings, and the mission that it changes. */
export function useTools(targetsByTool) {
  const [tool, setTool] = useState("move");
  const [path, setPath] = useState("");
  const [mark, setMark] = useState("OCCUPIED");
  const [brush, setBrush] = useState(BRUSHES[1]);
  const choices = targetsByTool[tool] ?? [];
  const target = choices.find((choice) => choice.path === path) ?? choices[0];
  const isMission = target?.how === "navigate" && tool === "goal";
  const mission = useReading(isMission ? target.shows : undefined, 4)?.value;
  return { tool, setTool, choices, target, setPath, mark, setMark, brush, setBrush, mission };
}
