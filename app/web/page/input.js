// Hands and feet: keys, mouse, touch pad, gamepad and buttons become the engine's 'input'.

const gamepadNames = {
    0: 'GamepadA', 1: 'GamepadB', 2: 'GamepadX', 3: 'GamepadY', 4: 'GamepadLeftBumper', 5: 'GamepadRightBumper',
    8: 'GamepadBack', 9: 'GamepadStart', 10: 'GamepadLeftStick', 11: 'GamepadRightStick', 12: 'GamepadUp', 13: 'GamepadDown', 14: 'GamepadLeft', 15: 'GamepadRight'
};
const codes = {
    Quote: 'Apostrophe', BracketLeft: 'LeftBracket', BracketRight: 'RightBracket', Backquote: 'GraveAccent',
    ShiftLeft: 'LeftShift', ShiftRight: 'RightShift', ControlLeft: 'LeftControl', ControlRight: 'RightControl',
    AltLeft: 'LeftAlt', AltRight: 'RightAlt'
};

/** The engine's name of a key: of its place on a US keyboard. */
export const keyName = (code) => codes[code] ??
    code.replace(/^(Key|Digit|Arrow)(?=.)/, '').replace(/^Numpad/, 'Keypad');

/** What the page does itself, besides telling the engine that it was done. */
export const ownActions = ['help', 'menu', 'review', 'pause', 'take_back', 'finish', 'back_to_start', 'skip', 'instructor'];

const deadZone = 0.15;
const beyondDeadZone = (value) =>
    Math.abs(value) < deadZone ? 0 : Math.sign(value) * (Math.abs(value) - deadZone) / (1 - deadZone);

export class Hands {
    /** `obey(action)`: does one of the page's own. `free()`: whether the hands are on the devices. */
    constructor(keys, obey, free) {
        this.obey = obey;
        this.free = free;
        this.actions = new Map(keys.actions.map((action) => [action.name, action]));
        this.byKey = new Map(keys.keys.map(({key, actions}) => [key, actions]));
        this.injectionByKey = new Map(keys.injections.map(({key}, k) => [key, k]));
        this.side = 0;
        this.used = new Set();
        this.letGo();
    }

    /** Of everything, as when the window is left. */
    letGo() {
        this.keys = new Set();
        this.buttons = new Set();
        this.tapped = new Set();
        this.padHand = {push: [0, 0], turn: [0, 0]};
        this.stick = {push: [0, 0], turn: [0, 0], buttons: new Set()};
        this.happened = {pressed: [], injections: [], wheel: 0, dragUp: 0, dragRight: 0, armLao: 0, armCranial: 0, tableLeft: 0, tableHead: 0};
        this.onHold?.();
    }

    /** What is pressed before the hands are free, as while the room opens, counts from then on. */
    hold(action, is = true) {
        if (is) {
            this.buttons.add(action);
            if (this.free()) this.tapped.add(action);
            this.used.add(action);
        } else {
            this.buttons.delete(action);
        }
        this.onHold?.();
    }
    press(action) {
        if (ownActions.includes(action)) return this.obey(action);
        if (!this.free()) return;
        this.happened.pressed.push(action);
        this.used.add(action);
    }
    inject(number) {
        if (!this.free()) return;
        this.happened.injections.push(number);
        this.used.add('inject');
    }
    add(name, amount) {
        if (this.free()) this.happened[name] += amount;
    }
    /** The pad is one hand at a time: −1…1. */
    pad(push, turn) {
        this.padHand = {push: [0, 0], turn: [0, 0]};
        if (!this.free()) return;
        this.padHand.push[this.side] = push;
        this.padHand.turn[this.side] = turn;
        if (push) this.used.add(this.side ? 'left_advance' : 'advance');
        if (turn) this.used.add('rotate_right');
    }

    /** Whether the key is one of the room's. */
    keyDown(name, repeats) {
        const actions = this.byKey.get(name) ?? [];
        const injection = this.injectionByKey.get(name);
        if (!actions.length && injection === undefined) return false;
        if (repeats || this.keys.has(name)) return true;
        this.keys.add(name);
        for (const action of actions) {
            if (this.actions.get(action)?.held) {
                this.buttons.delete(action);
                this.tapped.add(action);
                this.used.add(action);
            } else {
                this.press(action);
            }
        }
        if (injection !== undefined) this.inject(injection);
        this.onHold?.();
        return true;
    }
    keyUp(name) {
        this.keys.delete(name);
        this.onHold?.();
    }

    held() {
        const all = new Set(this.buttons);
        for (const name of [...this.keys, ...this.stick.buttons])
            for (const action of this.byKey.get(name) ?? [])
                if (this.actions.get(action)?.held) all.add(action);
        return all;
    }

    #pollGamepad() {
        const pad = navigator.getGamepads?.().find((one) => one?.connected && one.mapping === 'standard');
        if (!pad) {
            this.stick = {push: [0, 0], turn: [0, 0], buttons: new Set()};
            return;
        }
        const [leftX, leftY, rightX, rightY] = pad.axes.map(beyondDeadZone), before = this.stick.buttons;
        this.stick = {push: [-rightY, -leftY], turn: [rightX, leftX], buttons: new Set()};
        for (const [k, name] of Object.entries(gamepadNames)) {
            if (!pad.buttons[k]?.pressed) continue;
            this.stick.buttons.add(name);
            if (!before.has(name)) {
                this.keyDown(name, false);
                this.keys.delete(name);
            }
        }
    }

    /** The message of what changed since the last one, or null. */
    take() {
        this.#pollGamepad();
        const free = this.free(), held = free ? this.held() : new Set();
        if (free) for (const action of this.tapped) held.add(action);
        this.tapped.clear();
        const sum = (name) => [0, 1].map((k) =>
            free ? Math.max(-1, Math.min(1, this.padHand[name][k] + this.stick[name][k])) : 0);
        const state = {held: [...held].sort(), push: sum('push'), turn: sum('turn')}, words = JSON.stringify(state);
        const happened = this.happened;
        const something = Object.values(happened).some((value) => Array.isArray(value) ? value.length : value);
        if (words === this.last && !something) return null;
        this.last = words;
        this.happened = {...happened, pressed: [], injections: []};
        for (const name in this.happened) if (typeof this.happened[name] === 'number') this.happened[name] = 0;
        return {do: 'input', ...state, ...happened};
    }
}

/**
 * A button of an action. One that is held is held by pointer or Enter; a short click of the mouse, or of a screen
 * reader, keeps a pedal down until the next one.
 */
export function bindAction(button, hands, action) {
    if (!hands.actions.get(action)?.held) {
        button.addEventListener('click', (event) => {
            hands.press(action);
            if (event.detail) button.blur();
        });
        return;
    }
    const latches = ['Pedals'].includes(hands.actions.get(action).task) || ['fine', 'fast'].includes(action);
    let since = 0, wasHeld = false;
    const isHeld = () => hands.buttons.has(action);
    button.addEventListener('pointerdown', (event) => {
        if (event.button) return;
        event.preventDefault();
        button.setPointerCapture(event.pointerId);
        wasHeld = isHeld();
        since = event.timeStamp;
        hands.hold(action);
    });
    const end = (event) => {
        if (!since) return;
        const isClick = event.type === 'pointerup' && event.pointerType === 'mouse' && event.timeStamp - since < 250;
        since = 0;
        if (!(latches && isClick && !wasHeld)) hands.hold(action, false);
    };
    for (const name of ['pointerup', 'pointercancel', 'lostpointercapture']) button.addEventListener(name, end);
    button.addEventListener('keydown', (event) => {
        if (event.code !== 'Enter') return;
        event.preventDefault();
        event.stopPropagation();
        if (!event.repeat) hands.hold(action);
    });
    button.addEventListener('keyup', (event) => event.code === 'Enter' && hands.hold(action, false));
    button.addEventListener('blur', () => !latches && hands.hold(action, false));
    button.addEventListener('click', (event) => {
        if (event.detail || event.pointerType) return;
        if (latches) return hands.hold(action, !isHeld());
        hands.hold(action);
        setTimeout(() => hands.hold(action, false), 400);
    });
    button.addEventListener('contextmenu', (event) => event.preventDefault());
}

/** Mouse and fingers on the live image; `mmPerPixel()` is of the screen's pixels at the isocentre. */
export function bindImage(canvas, hands, mmPerPixel) {
    const fingers = new Map();
    canvas.addEventListener('pointerdown', (event) => {
        if (event.button !== 0 && event.button !== 2) return;
        canvas.setPointerCapture(event.pointerId);
        fingers.set(event.pointerId, {x: event.clientX, y: event.clientY, table: event.button === 2});
        canvas.focus({preventScroll: true});
        event.preventDefault();
    });
    canvas.addEventListener('pointermove', (event) => {
        const finger = fingers.get(event.pointerId);
        if (!finger) return;
        const right = event.clientX - finger.x, up = finger.y - event.clientY;
        finger.x = event.clientX;
        finger.y = event.clientY;
        const two = event.pointerType === 'touch' && fingers.size === 2;
        if (finger.table || two) {
            const scale = mmPerPixel() / (two ? 2 : 1);
            hands.add('tableLeft', right * scale);
            hands.add('tableHead', up * scale);
        } else {
            hands.add('dragRight', right);
            hands.add('dragUp', up);
            hands.used.add('advance');
        }
    });
    for (const name of ['pointerup', 'pointercancel'])
        canvas.addEventListener(name, ({pointerId}) => fingers.delete(pointerId));
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
    canvas.addEventListener('wheel', (event) => {
        event.preventDefault();
        hands.add('wheel', -event.deltaY / (event.deltaMode === 0 ? 100 : event.deltaMode === 1 ? 3 : 1));
        hands.used.add('advance');
    }, {passive: false});
}

/** The thumb's pad: from where it was touched, up pushes and sideways turns. */
export function bindPad(pad, hands) {
    const knob = pad.querySelector('i');
    let from = null;
    const reach = () => Math.min(pad.clientWidth, pad.clientHeight) * 0.38;
    const set = (x, y) => {
        knob.style.transform = `translate(${x * reach()}px, ${-y * reach()}px)`;
        hands.pad(beyondDeadZone(y), beyondDeadZone(x));
    };
    const limit = (value) => Math.max(-1, Math.min(1, value / reach()));
    pad.addEventListener('pointerdown', (event) => {
        pad.setPointerCapture(event.pointerId);
        from = {id: event.pointerId, x: event.clientX, y: event.clientY};
        event.preventDefault();
    });
    pad.addEventListener('pointermove', (event) => {
        if (from?.id === event.pointerId) set(limit(event.clientX - from.x), limit(from.y - event.clientY));
    });
    for (const name of ['pointerup', 'pointercancel', 'lostpointercapture'])
        pad.addEventListener(name, (event) => {
            if (from?.id !== event.pointerId) return;
            from = null;
            set(0, 0);
        });
}
