// Server of this page. The demo without a server puts a simulation in its place (board/web).
export const server = {
  events: () => new EventSource('stream'),
  request: (path, options) => fetch(path, options)
};
