// What the clients of an agent and of a recorded run have in common.

/** A refusal of the agent, with its remedy. */
export class Problem extends Error {
  constructor(status, detail, help = "", report = "") {
    super(detail);
    Object.assign(this, { status, help, report });
  }
}

/** The path of an operation on a property, such as `/slate/exp1/r2/planner/params`. */
export const at = (agent, path, kind = "slate") =>
  `/${kind}/${encodeURIComponent(agent)}/${path.split("/").map(encodeURIComponent).join("/")}`;

/** The methods of HTTP over a function `(method, path, body)`. */
export const methods = (call) => ({
  get: (path) => call("GET", path),
  put: (path, body) => call("PUT", path, body),
  patch: (path, body) => call("PATCH", path, body),
  post: (path, body) => call("POST", path, body),
  remove: (path) => call("DELETE", path),
});
