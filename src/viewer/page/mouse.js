// Moves a camera by mouse or finger, and reports clicks.

// isMoved() is called after a change of the camera, isClicked(x, y) with a position in pixels of
// the page.
function connectCamera(canvas, camera, isMoved, isClicked) {
  let drag = null;
  canvas.addEventListener('contextmenu', (event) => event.preventDefault());
  canvas.addEventListener('pointerdown', (event) => {
    canvas.setPointerCapture(event.pointerId);
    drag = {x: event.clientX, y: event.clientY, moved: 0,
      isMove: event.button !== 0 || event.shiftKey};
  });
  canvas.addEventListener('pointermove', (event) => {
    if (!drag) return;
    const [dx, dy] = [event.clientX - drag.x, event.clientY - drag.y];
    drag = {...drag, x: event.clientX, y: event.clientY,
      moved: drag.moved + Math.abs(dx) + Math.abs(dy)};
    if (drag.isMove || camera.mode === 'top') {
      camera.move(dx, dy, canvas.clientHeight);
    } else {
      camera.turn(dx, dy);
    }
    isMoved();
  });
  canvas.addEventListener('pointerup', (event) => {
    if (drag && drag.moved < 4) isClicked(event.clientX, event.clientY);
    drag = null;
  });
  canvas.addEventListener('wheel', (event) => {
    event.preventDefault();
    camera.zoom(Math.exp(0.001 * event.deltaY));
    isMoved();
  }, {passive: false});
}
