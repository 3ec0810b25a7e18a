#pragma once
/// An exercise for programs that act: steps, readings, snapshots, images on demand, and the recording of it;
/// its states as lines of JSON, for programs in other languages.

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/exercise/exercise.h"
#include "engine/exercise/imaging.h"
#include "engine/exercise/observation.h"
#include "engine/exercise/room_readout.h"
#include "engine/script/recording.h"
#include "render/panel/panel.h"
#include "render/picture/image.h"

namespace episode {

using exercise::Observation;
using exercise::Reader;

/// How an image on demand is made.
enum class ImageMode {
    Live,    // one pulse of fluoroscopy, without the lag of earlier ones
    Dsa,     // one pulse of DSA; the mask is the same place without devices and contrast
    Screen,  // what the room's screen shows: needs an exercise with images, and beam
    Cine     // one pulse of cine
};
inline constexpr std::array<std::string_view, 4> image_modes = {"live", "dsa", "screen", "cine"};

/// What cameras of one patient share, made when an image first needs it. May be used by many threads.
class PatientImages {
public:
    /// Throws InputError as make_imaging does.
    exercise::ImagingChain chain(const exercise::Simulation&, const anatomy::ModelCache&);
    /// Without the patient. Throws InputError as make_masking does.
    render::Fluoroscope masking(const exercise::Simulation&);
    /// Gives up what it has for others; who has a camera keeps it.
    void forget();

private:
    std::mutex mutex_;
    std::optional<exercise::ImagingChain> chain_;
    std::optional<render::Fluoroscope> masking_;
};

/// Makes images of any exercise of one patient. To be used by one thread at a time.
class Camera {
public:
    Camera(std::shared_ptr<PatientImages>, const anatomy::ModelCache&);

    /// An image of the simulation as it is, from that C-arm. It depends on the simulation's state and the
    /// seed of the noise alone. Throws InputError for the mode Screen, and as make_imaging does.
    render::GrayImage image(const exercise::Simulation&, const exercise::FrameTime&, const render::CArm&,
                            ImageMode, std::optional<std::uint64_t> seed = {});
    /// Puts into the cache what images from that arm need of the patient, so that cameras need no more of it
    /// as long as there is no contrast. False for what cannot be kept. Throws InputError as make_imaging
    /// does.
    bool keep_view(const exercise::Simulation&, const render::CArm&);
    /// 255 where the device casts its shadow, or a lumen lies in the beam, else 0. No body is made for them.
    /// Throws InputError as make_masking does.
    struct Masks {
        std::optional<render::GrayImage> extravasation;  // where contrast has leaked into tissue
        render::GrayImage vessels;
        std::vector<render::GrayImage> devices;  // of the simulation's, innermost first
        std::optional<render::GrayImage> stents;
    };
    const Masks& masks(const exercise::Simulation&, const exercise::FrameTime&, const render::CArm&);

private:
    exercise::Pulse pulse(const exercise::Simulation&, const exercise::FrameTime&, const render::CArm&) const;
    exercise::ImagingChain& chain(const exercise::Simulation&);
    render::Fluoroscope* still(const exercise::Simulation&, const exercise::Pulse&);
    std::shared_ptr<PatientImages> patient_;
    anatomy::ModelCache cache_;
    std::optional<exercise::ImagingChain> chain_;
    std::optional<render::Fluoroscope> masking_;
    // In place of the chain, until something asks for more of the patient.
    std::optional<render::Fluoroscope> still_;
    render::CArm still_arm_;
    // Of the last masks.
    std::optional<Masks> masks_;
    exercise::Pulse masked_;
};

/// The commands of an attempt, frame by frame. Copies share what was before.
class Log {
public:
    struct Made {
        std::span<const script::Command> commands;
        std::uint64_t hash = 0;
    };
    /// The frames from the first on; they last as long as this log or a copy.
    std::vector<Made> made() const;
    /// Whether the next frame needs its state's hash.
    bool states_next() const { return frames() % hash_every == 0; }
    void add(std::vector<script::Command> commands, std::uint64_t hash);
    void clear() { last_.reset(); }
    /// Writes a recording of it, `hash` that of the last frame's state. Throws InputError when the file
    /// cannot be written.
    void save(const std::filesystem::path&, const script::Origin&, std::uint64_t hash) const;
    int frames() const { return last_ ? last_->frame + 1 : 0; }

private:
    static constexpr int hash_every = 10;  // frames between two state lines of a recording
    struct Entry {
        ~Entry();
        std::shared_ptr<Entry> before;
        std::vector<script::Command> commands;
        std::uint64_t hash = 0;
        int frame = 0;
    };
    std::shared_ptr<Entry> last_;
};

class Episode {
public:
    /// Throws InputError as Exercise does.
    Episode(const scenario::Scenario&, exercise::Pictures, const anatomy::ModelCache& = {});
    /// Another episode of the same vessels, at its start, without images. It shares anatomy, wall, start and
    /// patient with `like`.
    Episode(const Episode& like);
    Episode& operator=(const Episode&) = delete;

    static constexpr std::size_t most_asked = 100'000;  // commands that wait for a frame
    /// Asks for a command with the next frame. Throws InputError for one that the exercise does not accept
    /// after those asked for before, which stay, and for more of them than `most_asked`.
    void ask(const script::Command&);
    /// The C-arm as it is, with what was asked for of it, for images `pixels` squared.
    render::CArm arm(int pixels) const;
    /// Makes a frame with what was asked for and these commands. Throws InputError for a command that the
    /// exercise does not accept; then no frame was made and nothing has changed: what was asked for stays. An
    /// injection or an exchange that was asked for is judged here, and forgotten when it is not accepted.
    void step(std::span<const script::Command>);
    Observation reading() const;
    Observation full_reading() const;  // with the errors of discretisation, which cost time
    const exercise::Exercise& exercise() const { return exercise_; }
    const exercise::Simulation& simulation() const { return exercise_.simulation(); }
    const Reader& reader() const { return reader_; }
    const std::shared_ptr<PatientImages>& patient() const { return patient_; }
    std::uint64_t hash() const;
    /// Commands for the next frame.
    std::span<const script::Command> asked() const { return asked_; }
    /// Asks for the table to move so that the tip lies within the image, so far from its edges, a fraction of
    /// its width, or as near to that as the table reaches. Nothing where it does already.
    void show_tip(double margin);
    static constexpr double usual_margin = 0.05;

    /// From now on the panel's readouts follow every frame. To be called before the first.
    void follow_room();
    /// The room's panel: readouts around the screen's image, or, without images, one pulse of fluoroscopy
    /// from the camera. Throws InputError without follow_room().
    render::ColourImage panel(render::Panel&, Camera*, std::optional<std::uint64_t> seed = {});
    render::ColourImage panel(render::Panel& drawn, std::optional<std::uint64_t> seed = {}) {
        return panel(drawn, nullptr, seed);
    }

    /// Restores the state after construction, bit for bit, with the target aimed at.
    void reset();
    /// Resets and sets another target. Throws InputError for one that is none; then the state is that after a
    /// reset with the old target.
    void aim(const scenario::Target&);

    struct Snapshot {
        exercise::Exercise::Snapshot exercise;
        Log log;
        std::vector<script::Command> asked = {};
        std::vector<std::byte> room = {};  // readouts of the panel, where they are followed
    };
    Snapshot snapshot() const;
    /// Throws InputError, and changes nothing, for a snapshot of another scenario or target.
    void restore(const Snapshot&);

    /// Throws InputError for sizes out of range, and for the mode Screen in another size than the screen's.
    render::GrayImage image(int pixels, ImageMode, std::optional<std::uint64_t> seed = {});
    const Camera::Masks& masks(int pixels);
    /// Keeps what images of this size need of the patient from the C-arm as it is: Camera::keep_view.
    bool keep_view(int pixels);
    /// Writes the commands since the start or the last reset() as a recording, with state hashes. Throws
    /// InputError when the file cannot be written, or is one that the scenario is read from.
    void save(const std::filesystem::path&, script::Origin) const;
    /// Throws InputError where the file, an output that `what` asks for, is one that the scenario or the
    /// standard input is read from.
    void require_no_input(const std::string& what, const std::filesystem::path&) const;

private:
    void check(std::span<const script::Command>, const render::CArm& start) const;
    const exercise::Console& console() const;  // as it is after what was asked for
    void follow(const script::Command&);
    Camera& camera();

    exercise::Exercise exercise_;
    Reader reader_;
    anatomy::ModelCache cache_;
    std::shared_ptr<PatientImages> patient_ = std::make_shared<PatientImages>();
    std::shared_ptr<const Snapshot> start_;
    std::unique_ptr<Camera> camera_;
    std::optional<exercise::RoomReadout> room_;
    std::vector<std::filesystem::path> read_;         // files of wires that exchanges have read
    std::vector<script::Command> asked_;              // for the next frame
    std::optional<exercise::Console> asked_console_;  // after these; empty = the exercise's own
    Log log_;
    mutable std::optional<std::uint64_t> hash_;  // of the state as it is
};

/// A list of numbers of a state, which has no place in a Observation: its length changes.
struct ListField {
    std::string_view name, unit, doc;
    int columns;  // of each row
    std::vector<double> (*of)(const Episode&, const render::CArm&);
};
std::span<const ListField> list_fields();

/// A command as in a script but without its frame: "arm lao 30 deg". Throws InputError.
script::Command parse_line(const std::string&);

/// One line: time, tip, target, wire and catheter in the room and in the image, hands, forces, flags, hash.
/// The keys are the names of State's fields in Python; numbers read back to the same bits.
std::string to_json(const Episode&);
/// The JSON Schema (2020-12) of what `serve` answers: states, scores, errors, names of files, numbers.
std::string schema_of_lines();
/// The score as in score.json, in one line. `program`: its name and version.
std::string score_line(const Episode&, const std::string& program);
/// A text as JSON.
std::string quoted(const std::string&);

}  // namespace episode
