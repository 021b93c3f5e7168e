// Says on the page what went wrong: nobody reads a browser's console.
function sayFault(text) {
  const message = document.getElementById("message");
  message.textContent = text;
  message.hidden = !text;
}
window.addEventListener("error", ({message}) => sayFault(`This page has failed: ${message}`));
window.addEventListener("unhandledrejection", ({reason}) =>
  sayFault(`This page has failed: ${reason && reason.message || reason}`));

