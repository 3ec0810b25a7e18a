// The engine, which runs in a worker. Questions that have one answer each are asked one after the other.

export class Engine {
    #worker;
    #hear;
    #questions = [];
    #asked = null;

    constructor(hear) {
        this.#hear = hear;
        this.#worker = new Worker('worker.js');
        this.#worker.onmessage = ({data}) => this.#receive(data);
        this.#worker.onerror = (event) => {
            const failed = {is: 'failed', error: `The engine stopped: ${event.message || 'worker.js could not be loaded'}.`};
            if (this.#asked) this.#receive(failed);
            this.#hear(failed);
        };
    }

    send(message, transfer = []) {
        this.#worker.postMessage(message, transfer);
    }

    look(look) {
        return this.#ask('picture', {do: 'look', mask: 0, shiftX: 0, shiftY: 0, window: 256, level: 128, ...look});
    }
    async debrief(recording, name) {
        return (await this.#ask('debriefing', {do: 'debrief', recording, name})).html;
    }
    async course(recordings) {
        return (await this.#ask('course', {do: 'course', recordings})).html;
    }

    /** Pictures of runs are forgotten with their exercise. */
    forgetLooks() {
        const dropped = this.#questions.filter(({message}) => message.do === 'look');
        this.#questions = this.#questions.filter(({message}) => message.do !== 'look');
        if (this.#asked?.message.do === 'look') dropped.push(this.#asked);
        if (dropped.includes(this.#asked)) this.#asked = null;
        for (const {refuse} of dropped) refuse(new Error('The exercise was left.'));
        this.#next();
    }

    #ask(answer, message) {
        return new Promise((resolve, refuse) => {
            this.#questions.push({answer, message, resolve, refuse});
            this.#next();
        });
    }
    #next() {
        if (this.#asked || !this.#questions.length) return;
        this.#asked = this.#questions.shift();
        this.send(this.#asked.message);
    }
    #receive(data) {
        const asked = this.#asked;
        const failed = data.is === 'failed' && asked && asked.answer !== 'picture';
        const isAnswer = failed || data.is === asked?.answer && (data.is !== 'picture' || data.run === asked.message.run);
        if (!isAnswer) return data.is === 'picture' ? undefined : this.#hear(data);
        this.#asked = null;
        if (data.is === 'failed') asked.refuse(new Error(data.error));
        else asked.resolve(data);
        this.#next();
    }
}
