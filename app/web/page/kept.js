// What this browser keeps of each learner: results, recordings, settings. Without IndexedDB all of it lasts as long as
// the page, and `problem` says so.

const stores = {
    learners: {keyPath: 'name'},
    results: {keyPath: ['learner', 'exercise']},
    recordings: {keyPath: 'id', autoIncrement: true},
    settings: {keyPath: 'name'}
};

const done = (request) => new Promise((resolve, reject) => {
    request.onsuccess = () => resolve(request.result);
    request.onerror = () => reject(request.error ?? new Error('unknown'));
});

function openDatabase() {
    const request = indexedDB.open('seldinger', 1);
    request.onupgradeneeded = () => {
        for (const [name, options] of Object.entries(stores)) request.result.createObjectStore(name, options);
    };
    return Promise.race([
        done(request),
        new Promise((_, reject) => {
            request.onblocked = () => reject(new Error('another tab holds an older version open'));
            setTimeout(() => reject(new Error('it did not answer')), 4000);
        })
    ]);
}

export class Kept {
    problem = '';
    #database = null;
    #memory = Object.fromEntries(Object.keys(stores).map((name) => [name, new Map()]));
    #count = 0;

    async open() {
        try {
            this.#database = await openDatabase();
            this.#database.onversionchange = () => this.#database.close();
        } catch (error) {
            this.#lose(error);
        }
        return this;
    }

    learners() {
        return this.#all('learners').then((all) => all.sort((a, b) => b.last - a.last).map(({name}) => name));
    }
    cameBack(name) {
        return this.#put('learners', {name, last: Date.now()});
    }

    /** Of one learner ('' is the guest): exercise → {attempts, reached, passed, points, steps, time, patients}. */
    async results(learner) {
        const all = (await this.#all('results')).filter((result) => result.learner === learner);
        return new Map(all.map((result) => [result.exercise, result]));
    }

    async addResult(learner, exercise, {reached, passed, points, seconds, steps, patient}) {
        const none = {learner, exercise, attempts: 0, reached: 0, passed: 0, points: 0, steps: 0, time: null, patients: {}};
        const best = (await this.results(learner)).get(exercise) ?? none;
        const other = patient ? best.patients[patient] ??= {attempts: 0, reached: 0} : null;
        for (const counts of other ? [best, other] : [best]) {
            counts.attempts += 1;
            counts.reached += reached ? 1 : 0;
        }
        best.passed += passed ? 1 : 0;
        best.points = Math.max(best.points, points ?? 0);
        best.steps = Math.max(best.steps, steps ?? 0);
        if (reached && seconds != null) best.time = Math.min(best.time ?? Infinity, seconds);
        await this.#put('results', best);
    }

    /** `recording`: {learner, name, exercise, title, date, points, passed, bytes}. */
    addRecording(recording) {
        return this.#put('recordings', recording);
    }
    async recordings(learner = null) {
        const all = await this.#all('recordings');
        return all.filter((one) => learner === null || one.learner === learner).sort((a, b) => b.date - a.date);
    }
    deleteRecording(id) {
        return this.#use('recordings', 'readwrite', (store) => store.delete(id), (map) => map.delete(id));
    }

    async setting(name, otherwise) {
        const found = await this.#use('settings', 'readonly', (store) => store.get(name), (map) => map.get(name));
        return found ? found.value : otherwise;
    }
    setSetting(name, value) {
        return this.#put('settings', {name, value});
    }

    #all(name) {
        return this.#use(name, 'readonly', (store) => store.getAll(), (map) => [...map.values()]);
    }
    #put(name, value) {
        return this.#use(name, 'readwrite', (store) => store.put(value), (map) => {
            const {keyPath} = stores[name];
            if (keyPath === 'id') value.id ??= `memory ${++this.#count}`;
            map.set(Array.isArray(keyPath) ? keyPath.map((key) => value[key]).join('\n') : value[keyPath], value);
        });
    }

    async #use(name, mode, ask, remember) {
        if (this.#database) {
            try {
                const change = this.#database.transaction(name, mode);
                const answer = await done(ask(change.objectStore(name)));
                if (mode === 'readwrite')
                    await new Promise((resolve, reject) => {
                        change.oncomplete = resolve;
                        change.onabort = () => reject(change.error ?? new Error('it was taken back'));
                    });
                return answer;
            } catch (error) {
                this.#lose(error);
            }
        }
        return remember(this.#memory[name]);
    }

    #lose(error) {
        this.#database = null;
        this.problem = `This browser keeps nothing for this page (${error?.message || error}): results and recordings ` +
            'last until the page is closed. Download the recordings that you want to keep.';
        this.onProblem?.(this.problem);
    }
}
