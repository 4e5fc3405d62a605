        // Uses the page as a reader would and notes its state.
        const [canvas] = document.querySelectorAll('.view canvas');
        const seen = () => {
          const all = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
          const colours = new Set();
          for (let k = 0; k < all.length; k += 4) colours.add(all[k] * 65536 + all[k + 1] * 256 + all[k + 2]);
          return [...colours].length;
        };
        replay.show();
        found.colours = seen();
        // A window is no narrower than 500 pixels there.
        document.documentElement.style.width = '400px';
        found.width = document.body.clientWidth;
        found.overflow = document.body.scrollWidth - document.body.clientWidth;
        found.narrow = canvas.clientWidth;
        found.plots = document.querySelectorAll('.plot').length;
        const begun = replay.state.time;
        press('ArrowRight');
        found.step = replay.state.time - begun;
        press('Home');
        found.home = replay.state.time - replay.span[0];
        press('End');
        found.end = replay.state.time - replay.span[1];
        const { yaw, distance } = replay.camera;
        press('ArrowLeft', canvas);
        press('+');
        found.turned = replay.camera.yaw - yaw;
        found.zoomed = replay.camera.distance / distance;
        const slider = document.getElementById('time');
        slider.value = 2;
        slider.dispatchEvent(new Event('input'));
        found.scrubbed = replay.state.time;
        document.getElementById('colour').value = 2;
        document.getElementById('colour').dispatchEvent(new Event('change'));
        found.colour = replay.state.colour;
        found.unit = document.getElementById('range').textContent;
        press('0');
        press('Home');
        found.rates = [];
        press(' ');
        for (let k = 0; k < 3; k++) {
          const [from, count] = [performance.now(), replay.frames.count];
          await wait(700);
          found.rates.push(1000 * (replay.frames.count - count) / (performance.now() - from));
        }
        found.playing = replay.state.playing;
        found.played = replay.state.time;
        press(' ');
        found.paused = !replay.state.playing;
        found.cursor = document.querySelector('.cursor').style.left;
