/** A worker that runs a script. Throws where a browser lets a page have none. */
function workerOf(script) {
  const address = URL.createObjectURL(new Blob([script], { type: "text/javascript" }));
  setTimeout(() => URL.revokeObjectURL(address), 10000); // some browsers read it later
  return new Worker(address);
}
