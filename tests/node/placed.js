// Where the plant of the viewer's page is in the picture: its share of the height above the controls and below a header that goes
// over the whole width, which cards are over it, and whether it or a control is outside of the window.
() => {
  const { stage, plants: [{ ath, space }] } = athcodecViewer, { camera, width, height } = stage, point = camera.position.clone(), x = [], y = [];
  stage.render();
  for (let i = 0; i < ath.rest.length; i += 3) {
    point.fromArray(ath.rest, i).applyMatrix4(space.matrixWorld).project(camera);
    x.push((point.x + 1) / 2 * width);
    y.push((1 - point.y) / 2 * height);
  }
  const plant = { left: Math.min(...x), right: Math.max(...x), top: Math.min(...y), bottom: Math.max(...y) };
  const seen = (selector) => [...document.querySelectorAll(selector)].filter((each) => each.checkVisibility()).map((each) => each.getBoundingClientRect());
  const meets = ({ left, top, right, bottom }) => left < plant.right && right > plant.left && top < plant.bottom && bottom > plant.top;
  const outside = ({ left, top, right, bottom }) => left < 0 || top < 0 || right > width || bottom > height;
  const share = Math.max(plant.right - plant.left, plant.bottom - plant.top) / Math.min(width, height);
  const [head, foot] = seen("header, footer"), top = head.width > 0.8 * width ? head.bottom : 0;
  return { plant, tall: (plant.bottom - plant.top) / (foot.top - top), over: seen("header, nav, #panel, footer").filter(meets), outside: [plant, ...seen("header, nav button, footer *")].filter(outside), share };
}
