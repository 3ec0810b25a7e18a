/// The Python module seldinger._core: simulations one at a time and many at once, as NumPy arrays.

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "app/python/docs.h"
#include "engine/episode/episode.h"
#include "engine/episode/pool.h"
#include "engine/exercise/score_file.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "physics/geometry/vec.h"
#include "render/picture/png.h"

namespace py = pybind11;

namespace app {
namespace {

using episode::Episode;
using geometry::Vec3;
using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Flags = py::array_t<bool, py::array::c_style | py::array::forcecast>;

constexpr double largest_motion = script::largest_motion;      // [mm]
constexpr double largest_rotation = script::largest_rotation;  // [deg]
constexpr double largest_place = 1e4;                          // [mm], that of a scenario's coordinates
constexpr int devices = 2;

std::string text_of(double value) {
    return py::str(py::float_(value));
}

/// A motion as a script would accept it.
double checked(double value, double most, const char* what, const char* unit) {
    if (!(std::abs(value) <= most))
        throw io::InputError(std::string(what) + ": " + text_of(value) + " " + unit + " was given; -" +
                             text_of(most) + " to " + text_of(most) + " is accepted");
    return value;
}

/// Asks Python for Ctrl-C; to be called with the interpreter locked.
void check_signals() {
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

py::array_t<double> array_of(const Vec3& v) {
    py::array_t<double> a(3);
    std::copy_n(v.data(), 3, a.mutable_data());
    return a;
}

py::array_t<double> array_of(const geometry::Polyline& line, const Vec3& shift) {
    py::array_t<double> a({static_cast<py::ssize_t>(line.size()), py::ssize_t{3}});
    double* to = a.mutable_data();
    for (const Vec3& p : line)
        for (int k = 0; k < 3; ++k) *to++ = p[k] + shift[k];
    return a;
}

py::array_t<double> pixels_of(const render::CArm& arm, const geometry::Polyline& line, const Vec3& shift) {
    py::array_t<double> a({static_cast<py::ssize_t>(line.size()), py::ssize_t{2}});
    double* to = a.mutable_data();
    for (const Vec3& p : line) {
        const render::Pixel pixel = render::project(arm, p + shift);
        *to++ = pixel.x;
        *to++ = pixel.y;
    }
    return a;
}

py::array_t<double> pixel_of(const render::CArm& arm, const Vec3& place) {
    const render::Pixel pixel = render::project(arm, place);
    py::array_t<double> a(2);
    a.mutable_at(0) = pixel.x;
    a.mutable_at(1) = pixel.y;
    return a;
}

py::array_t<std::uint8_t> array_of(const render::GrayImage& image) {
    py::array_t<std::uint8_t> a({image.height, image.width});
    std::copy(image.pixels.begin(), image.pixels.end(), a.mutable_data());
    return a;
}
py::array_t<std::uint8_t> array_of(const render::ColourImage& image) {
    py::array_t<std::uint8_t> a({image.height, image.width, 3});
    std::copy(image.pixels.begin(), image.pixels.end(), a.mutable_data());
    return a;
}

struct State {
    episode::Reading reading;
    std::string branch;
    std::uint64_t hash = 0;
    py::array_t<double> tip, direction, target, tip_px, target_px, wire, wire_px, catheter, catheter_px,
        force;
};

State state_of(const Episode& episode) {
    State s;
    const exercise::Simulation& simulation = episode.simulation();
    s.reading = episode.reading();
    const episode::Reading& r = s.reading;
    const render::CArm arm = episode.arm(simulation.scenario().c_arm.pixels);
    s.branch = simulation.anatomy().branches[static_cast<std::size_t>(r.branch)].name;
    s.hash = episode.hash();
    s.tip = array_of(r.tip);
    s.direction = array_of(r.direction);
    s.target = array_of(r.target);
    s.tip_px = pixel_of(arm, r.tip);
    s.target_px = pixel_of(arm, r.target);
    const geometry::Polyline wire = simulation.path_of(script::Held::Wire);
    s.wire = array_of(wire, r.shift);
    s.wire_px = pixels_of(arm, wire, r.shift);
    const geometry::Polyline catheter =
        simulation.has_catheter() ? simulation.path_of(script::Held::Catheter) : geometry::Polyline();
    s.catheter = array_of(catheter, r.shift);
    s.catheter_px = pixels_of(arm, catheter, r.shift);
    const auto contacts = simulation.contacts();
    s.force = py::array_t<double>(static_cast<py::ssize_t>(contacts.size()));
    for (std::size_t i = 0; i < contacts.size(); ++i) s.force.mutable_data()[i] = contacts[i].force();
    return s;
}

script::Held held_of(const py::object& device) {
    if (py::isinstance<py::str>(device)) {
        const std::string name = device.cast<std::string>();
        for (std::size_t k = 0; k < script::held_names.size(); ++k)
            if (script::held_names[k] == name) return static_cast<script::Held>(k);
    } else if (PyIndex_Check(device.ptr()) != 0) {  // whole numbers of Python and of NumPy
        const Py_ssize_t index = PyNumber_AsSsize_t(device.ptr(), nullptr);  // a huge one becomes the largest
        if (index == 0) return script::Held::Wire;
        if (index == 1) return script::Held::Catheter;
        PyErr_Clear();
    }
    throw io::InputError("device: " + std::string(py::repr(device)) +
                         " was given; 'wire', 'catheter', 'both', 0 (wire) or 1 (catheter) is accepted");
}

episode::ImageMode mode_of(const std::string& mode) {
    for (std::size_t k = 0; k < episode::image_modes.size(); ++k)
        if (episode::image_modes[k] == mode) return static_cast<episode::ImageMode>(k);
    throw io::InputError("mode: '" + mode + "' was given; 'live', 'dsa' or 'screen' is accepted");
}

/// Three coordinates [mm] of what a caller gave; empty where it is not that.
std::optional<Vec3> place_of(const py::object& given) {
    const py::array any = py::array::ensure(given);
    if (!any || std::string("iuf").find(any.dtype().kind()) == std::string::npos || any.size() != 3)
        return {};
    const Doubles numbers = Doubles::ensure(any);
    if (!numbers) return {};
    const Vec3 place(numbers.data());
    for (const double x : place)
        if (!(std::abs(x) <= largest_place)) return {};  // NaN is none, which Eigen's maxCoeff may pass over
    return place;
}

/// A place [mm], in the words of the argument `what`.
Vec3 checked_place(const py::object& given, const char* what) {
    if (const std::optional<Vec3> place = place_of(given)) return *place;
    throw io::InputError(std::string(what) + ": " + std::string(py::repr(given)) +
                         " was given; three finite coordinates in mm, up to 10000 in size, are accepted");
}

/// What a caller asked for in place of a target: the name of one or a place, a radius, or both.
struct Aim {
    Aim(const py::object& target, const std::optional<double>& given) : radius(given) {
        if (py::isinstance<py::str>(target)) {
            name = target.cast<std::string>();
        } else if (!target.is_none()) {
            centre = place_of(target);
            if (!centre)
                throw io::InputError(
                    "target: " + std::string(py::repr(target)) +
                    " was given; the name of a target, or three finite coordinates in mm, up "
                    "to 10000 in size, is accepted");
        }
        if (radius && !(*radius >= 0.1 && *radius <= 100))
            throw io::InputError("radius_mm: " + text_of(*radius) + " was given; 0.1 to 100 is accepted");
    }
    scenario::Target of(const scenario::Scenario& scenario) const {
        scenario::Target target = scenario.target;
        if (name || centre) {
            target.name = name.value_or("");
            target.centre = centre;
        }
        if (radius) target.radius = *radius;
        return target;
    }
    std::optional<std::string> name;
    std::optional<Vec3> centre;
    std::optional<double> radius;
};

struct Snapshot {
    Episode::Snapshot state;
};

/// The panel in the size that was asked for last.
class PanelOfSize {
public:
    render::Panel& of(int width, int height) {
        if (width < 640 || width > 4096 || height < 512 || height > 4096)
            throw io::InputError("panel: " + std::to_string(width) + " x " + std::to_string(height) +
                                 " pixels were asked for; 640 x 512 to 4096 x 4096 is accepted");
        if (!panel_ || width != width_ || height != height_) {
            render::PanelSpec spec;
            spec.width = width_ = width;
            spec.height = height_ = height;
            panel_.emplace(spec);
        }
        return *panel_;
    }

private:
    std::optional<render::Panel> panel_;
    int width_ = 0, height_ = 0;
};

using Overrides = std::vector<std::pair<std::string, std::string>>;

scenario::Scenario scenario_of(const std::string& file, const std::optional<std::string>& text,
                               const std::string& catalogue, const Overrides& overrides) {
    std::vector<scenario::Override> values;
    for (const auto& [key, value] : overrides) values.push_back({key, value});
    return text ? scenario::parse_scenario(*text, file, catalogue, values)
                : scenario::load_scenario(file, catalogue, values);
}

/// What scenarios that take turns in one environment must have in common. No vessels are grown for it.
py::dict facts(const std::string& file, const std::optional<std::string>& text, const std::string& catalogue,
               const Overrides& overrides) {
    const scenario::Scenario scenario = scenario_of(file, text, catalogue, overrides);
    py::dict made;
    made["devices"] = scenario.catheter ? 2 : 1;
    made["frame_rate_hz"] = scenario.frame_rate;
    made["pixels"] = scenario.c_arm.pixels;
    return made;
}

class Simulation {
public:
    Simulation(const std::string& file, const std::optional<std::string>& text, const std::string& catalogue,
               const Overrides& overrides, const std::string& images, const std::string& cache_folder,
               bool panel) {
        exercise::Pictures pictures;
        if (images == "none")
            pictures = exercise::Pictures::None;
        else if (images == "dose")
            pictures = exercise::Pictures::Dose;
        else if (images == "all")
            pictures = exercise::Pictures::All;
        else
            throw io::InputError("images: '" + images + "' was given; False, 'dose' or True is accepted");
        anatomy::ModelCache cache;
        cache.folder = cache_folder;
        cache.progress = [](double, const char*) {
            const py::gil_scoped_acquire locked;
            check_signals();
        };
        const py::gil_scoped_release free;
        episode_ = std::make_unique<Episode>(scenario_of(file, text, catalogue, overrides), pictures, cache);
        if (panel) episode_->follow_room();
        cache_ = cache;
    }
    explicit Simulation(std::unique_ptr<Episode> episode, anatomy::ModelCache cache)
        : episode_(std::move(episode)), cache_(std::move(cache)) {}

    /// Calls use(episode) with the interpreter free and this simulation locked.
    template <class Use>
    auto with(const Use& use) {
        const py::gil_scoped_release free;
        const std::lock_guard lock(mutex_);
        return use(open());
    }
    Episode& open() {
        if (!episode_) throw io::InputError("the simulation is closed; one that is open is accepted");
        return *episode_;
    }

    /// Locks this simulation for work with Python's objects. A call in another thread is waited for with the
    /// interpreter free, so that neither waits for the other.
    std::unique_lock<std::mutex> locked() {
        std::unique_lock lock(mutex_, std::defer_lock);
        const py::gil_scoped_release free;
        lock.lock();
        return lock;
    }

    State state() {
        const auto lock = locked();
        return state_of(open());
    }

    State step(double advance, double rotate, const py::object& device, double catheter_advance,
               double catheter_rotate, int frames) {
        if (frames < 1 || frames > script::largest_frame)
            throw io::InputError("frames: " + std::to_string(frames) + " was given; 1 to " +
                                 std::to_string(script::largest_frame) + " is accepted");
        const script::Held held = held_of(device);
        checked(advance, largest_motion, "advance_mm", "mm");
        checked(rotate, largest_rotation, "rotate_deg", "deg");
        checked(catheter_advance, largest_motion, "catheter_advance_mm", "mm");
        checked(catheter_rotate, largest_rotation, "catheter_rotate_deg", "deg");
        std::vector<script::Command> commands;
        if (advance != 0) commands.push_back(episode::feed(advance, held));
        if (rotate != 0) commands.push_back(script::Rotate{rotate * geometry::degree, held});
        if (catheter_advance != 0)
            commands.push_back(episode::feed(catheter_advance, script::Held::Catheter));
        if (catheter_rotate != 0)
            commands.push_back(script::Rotate{catheter_rotate * geometry::degree, script::Held::Catheter});
        for (int frame = 0; frame < frames; ++frame) {
            with([&](Episode& episode) { episode.step(commands); });
            check_signals();
        }
        return state();
    }

    void apply(const std::string& command) {
        with([&](Episode& episode) { episode.ask(episode::parse_line(command)); });
    }

    State reset(const py::object& target, const std::optional<double>& radius) {
        const Aim aim(target, radius);
        with([&](Episode& episode) {
            if (target.is_none() && !radius)
                episode.reset();
            else
                episode.aim(aim.of(episode.simulation().scenario()));
        });
        return state();
    }

    Snapshot snapshot() {
        return with([](Episode& episode) { return Snapshot{episode.snapshot()}; });
    }
    State restore(const Snapshot& snapshot) {
        with([&](Episode& episode) { episode.restore(snapshot.state); });
        return state();
    }

    py::array_t<std::uint8_t> image(const std::optional<int>& pixels, const std::string& mode,
                                    const std::optional<std::uint64_t>& seed) {
        const episode::ImageMode as = mode_of(mode);
        const render::GrayImage made = with([&](Episode& episode) {
            return episode.image(pixels.value_or(episode.simulation().scenario().c_arm.pixels), as, seed);
        });
        return array_of(made);
    }
    py::array_t<std::uint8_t> panel(int width, int height, const std::optional<std::uint64_t>& seed) {
        return array_of(
            with([&](Episode& episode) { return episode.panel(panel_.of(width, height), seed); }));
    }
    py::dict masks(const std::optional<int>& pixels) {
        const episode::Camera::Masks* made = nullptr;
        const auto lock = locked();
        {
            const py::gil_scoped_release free;
            Episode& episode = open();
            made = &episode.masks(pixels.value_or(episode.simulation().scenario().c_arm.pixels));
        }
        py::dict masks;
        masks["wire"] = array_of(made->wire);
        if (made->catheter) masks["catheter"] = array_of(*made->catheter);
        masks["vessels"] = array_of(made->vessels);
        return masks;
    }
    Doubles project(const Doubles& places, const std::optional<int>& pixels) {
        if (places.ndim() != 2 || places.shape(1) != 3)
            throw io::InputError("places_mm: an array of shape (n, 3) is accepted");
        const auto lock = locked();
        const render::CArm arm = open().arm(pixels.value_or(open().simulation().scenario().c_arm.pixels));
        Doubles a({places.shape(0), py::ssize_t{2}});
        for (py::ssize_t i = 0; i < places.shape(0); ++i) {
            const render::Pixel pixel = render::project(arm, Vec3(places.data(i, 0)));
            a.mutable_at(i, 0) = pixel.x;
            a.mutable_at(i, 1) = pixel.y;
        }
        return a;
    }
    Doubles camera_matrix(const std::optional<int>& pixels) {
        const auto lock = locked();
        const Eigen::Matrix<double, 3, 4> camera =
            render::camera_matrix(open().arm(pixels.value_or(open().simulation().scenario().c_arm.pixels)));
        Doubles a({3, 4});
        for (int row = 0; row < 3; ++row)
            for (int column = 0; column < 4; ++column) a.mutable_at(row, column) = camera(row, column);
        return a;
    }

    static std::string score_of(const Episode& episode) {
        const exercise::Exercise& exercise = episode.exercise();
        return exercise::to_json({program(),
                                  {},
                                  exercise.finish(),
                                  exercise.earlier_attempts(),
                                  exercise.simulation().scenario().lesson.par});
    }
    static void save_to(const std::filesystem::path& path, const Episode& episode) {
        script::Origin origin;
        origin.program = program();
        episode.save(path, origin);
    }
    std::string score() {
        return with([](Episode& episode) { return score_of(episode); });
    }
    void save(const std::filesystem::path& path) {
        with([&](Episode& episode) { save_to(path, episode); });
    }
    void close() {
        const py::gil_scoped_release free;
        const std::lock_guard lock(mutex_);
        episode_.reset();
    }
    bool closed() {
        const auto lock = locked();
        return !episode_;
    }

    std::unique_ptr<Simulation> copy() {
        return with([&](Episode& episode) { return std::make_unique<Simulation>(beside(episode), cache_); });
    }
    static std::unique_ptr<Episode> beside(const Episode& episode) {
        if (episode.exercise().monitor())
            throw io::InputError(
                "a simulation with images=True cannot be shared; one with False or 'dose' is accepted");
        return std::make_unique<Episode>(episode);
    }
    const anatomy::ModelCache& cache() const { return cache_; }

    py::dict anatomy() {
        const auto lock = locked();
        const anatomy::Anatomy& anatomy = open().simulation().anatomy();
        py::dict made;
        made["name"] = anatomy.name;
        py::list branches, ends, targets;
        for (const auto& branch : anatomy.branches) {
            py::dict one;
            one["name"] = branch.name;
            one["parent"] = branch.parent;
            one["points_mm"] = array_of(branch.points, Vec3::Zero());
            one["radii_mm"] =
                py::array_t<double>(static_cast<py::ssize_t>(branch.radii.size()), branch.radii.data());
            branches.append(one);
        }
        for (const auto& end : anatomy.ends) ends.append(end.opening.name);
        for (const auto& target : anatomy.targets) {
            py::dict one;
            one["name"] = target.name;
            one["centre_mm"] = array_of(target.centre);
            one["branch"] = anatomy.branches[static_cast<std::size_t>(target.branch)].name;
            targets.append(one);
        }
        made["branches"] = branches;
        made["ends"] = ends;
        made["targets"] = targets;
        py::array_t<double> vertices = array_of(anatomy.lumen.vertices, Vec3::Zero());
        made["vertices_mm"] = vertices;
        return made;
    }
    py::dict about() {
        const auto lock = locked();
        const exercise::Simulation& simulation = open().simulation();
        const scenario::Scenario& s = simulation.scenario();
        py::dict made;
        made["name"] = s.name;
        made["title"] = s.title;
        made["frame_rate_hz"] = s.frame_rate;
        made["time_limit_s"] = s.time_limit ? py::object(py::float_(*s.time_limit)) : py::none();
        made["devices"] = simulation.has_catheter() ? 2 : 1;
        made["target_by"] = s.target.by_catheter ? "catheter" : "wire";
        made["target_radius_mm"] = s.target.radius;
        made["pixels"] = s.c_arm.pixels;
        made["field_mm"] = s.c_arm.detector_width * s.c_arm.sod / s.c_arm.sid;
        made["lao_deg"] = s.c_arm.lao / geometry::degree;
        made["cranial_deg"] = s.c_arm.cranial / geometry::degree;
        made["wire_length_mm"] = s.wire_length;
        return made;
    }
    std::optional<double> way_from(const py::object& given) {
        const Vec3 place = checked_place(given, "place_mm");
        return with([&](Episode& episode) { return episode.reader().way_from(episode.simulation(), place); });
    }

    static std::string program() { return "seldinger " SELDINGER_VERSION; }

private:
    std::unique_ptr<Episode> episode_;
    anatomy::ModelCache cache_;
    PanelOfSize panel_;
    std::mutex mutex_;
};

/// Cameras of one thread, one for each anatomy that was imaged last.
class Cameras {
public:
    episode::Camera& of(const exercise::Simulation& simulation, const anatomy::ModelCache& cache) {
        for (Kept& kept : kept_)
            if (&kept.like->anatomy() == &simulation.anatomy()) return *kept.camera;
        auto camera = std::make_unique<episode::Camera>(simulation, cache);
        if (kept_.size() == most) kept_.erase(kept_.begin());
        kept_.push_back({std::make_unique<exercise::Simulation>(simulation), std::move(camera)});
        return *kept_.back().camera;
    }
    void clear() { kept_.clear(); }

private:
    static constexpr std::size_t most = 4;
    struct Kept {
        std::unique_ptr<const exercise::Simulation> like;  // keeps the anatomy
        std::unique_ptr<episode::Camera> camera;
    };
    std::vector<Kept> kept_;
};

class VectorSimulation {
public:
    VectorSimulation(Simulation& like, int n, int threads, int points, double spacing)
        : n_(checked_count("n", n, 100'000)),
          pool_(checked_count("threads", threads, 256)),
          cameras_(static_cast<std::size_t>(threads)),
          points_(checked_count("points", points, 1000)),
          spacing_(spacing),
          cache_(like.cache()) {
        if (!(spacing > 0 && spacing <= 100))
            throw io::InputError("spacing_mm: " + text_of(spacing) +
                                 " was given; above 0 to 100 is accepted");
        while (static_cast<int>(episodes_.size()) < n) {
            like.with([&](Episode& episode) {
                for (int k = 0; k < 100 && static_cast<int>(episodes_.size()) < n; ++k)
                    episodes_.push_back(Simulation::beside(episode));
            });
            check_signals();
        }
        const auto of = [n](std::vector<py::ssize_t> more) {
            more.insert(more.begin(), n);
            return py::array_t<double>(more);
        };
        for (const char* name :
             {"along_mm", "path_to_target_mm", "tip_to_target_mm", "tip_force_N", "wall_force_N", "time_s",
              "target_radius_mm", "air_kerma_mGy", "area_product_Gycm2"})
            arrays_[name] = of({});
        for (const char* name : {"tip_mm", "tip_direction", "target_mm", "shift_mm"}) arrays_[name] = of({3});
        for (const char* name : {"tip_px", "target_px"}) arrays_[name] = of({2});
        for (const char* name : {"inserted_mm", "turned_rad", "push_N", "torque_Nmm"})
            arrays_[name] = of({devices});
        arrays_["track_mm"] = of({points, 3});
        arrays_["track_px"] = of({points, 2});
        for (const char* name : {"frame", "branch"}) whole_[name] = py::array_t<std::int64_t>(n);
        for (const char* name :
             {"settling", "at_rest", "certified", "refused", "buckled", "insertion_stopped",
              "withdrawal_stopped", "whole_wire_is_in", "too_thick", "completed", "on_target", "time_is_up"})
            flags_[name] = py::array_t<bool>(n);
        bind();
        in_parts(many, [&](int i, int) { fill(i); });
    }

    int size() const { return n_; }
    int threads() const { return pool_.threads(); }

    py::dict arrays() const {
        py::dict all;
        for (const auto& [name, array] : arrays_) all[name.c_str()] = array;
        for (const auto& [name, array] : whole_) all[name.c_str()] = array;
        for (const auto& [name, array] : flags_) all[name.c_str()] = array;
        return all;
    }

    void step(const Doubles& motions, int frames, const py::object& active) {
        require_open();
        if (motions.ndim() != 3 || motions.shape(0) != size() || motions.shape(1) < 1 ||
            motions.shape(1) > devices || motions.shape(2) != 2)
            throw io::InputError("motions: an array of shape (" + std::to_string(size()) +
                                 ", 1 or 2 devices, 2) is accepted: mm and rad");
        if (frames < 1 || frames > script::largest_frame)
            throw io::InputError("frames: " + std::to_string(frames) + " was given; 1 to " +
                                 std::to_string(script::largest_frame) + " is accepted");
        const std::optional<Flags> mask = checked_mask(active, "active");
        const bool* const on = mask ? mask->data() : nullptr;
        const auto of = static_cast<int>(motions.shape(1));
        const double* const data = motions.data();
        for (py::ssize_t k = 0; k < motions.size(); ++k)
            checked(data[k], k % 2 == 0 ? largest_motion : largest_rotation * geometry::degree, "motions",
                    k % 2 == 0 ? "mm" : "rad");
        if (of > 1) {
            const py::gil_scoped_release free;
            const std::lock_guard lock(mutex_);
            for (int i = 0; i < size(); ++i) {
                const double* const m = data + static_cast<std::ptrdiff_t>(i) * of * 2;
                if ((on && !on[i]) || (m[2] == 0 && m[3] == 0) || checked_at(i).simulation().has_catheter())
                    continue;
                throw io::InputError(
                    "simulation " + std::to_string(i) +
                    ": a motion of a catheter was given, and the scenario has none; 0 is accepted");
            }
        }
        for (int frame = 0; frame < frames; ++frame) {
            in_parallel([&](int i, int) {
                if (on && !on[i]) return;
                const double* const m = data + static_cast<std::ptrdiff_t>(i) * of * 2;
                std::vector<script::Command> commands;
                episode::append({m[0], m[1], of > 1 ? m[2] : 0, of > 1 ? m[3] : 0}, commands);
                at(i).step(commands);
                if (frame + 1 == frames) fill(i);
            });
            check_signals();
        }
    }
    void reset(const py::object& which) {
        require_open();
        const std::optional<Flags> mask = checked_mask(which, "which");
        const bool* const on = mask ? mask->data() : nullptr;
        in_parts(many, [&](int i, int) {
            if (on && !on[i]) return;
            at(i).reset();
            fill(i);
        });
    }
    void assign(int i, Simulation& like) {
        with(i, [](Episode&) {});
        std::unique_ptr<Episode> made;
        like.with([&](Episode& episode) { made = Simulation::beside(episode); });
        with(i, [&](Episode&) {
            episodes_[static_cast<std::size_t>(i)].swap(made);
            fill(i);
        });
    }
    void aim(int i, const py::object& target, const std::optional<double>& radius) {
        with(i, [](Episode&) {});
        if (target.is_none())
            throw io::InputError(
                "target: None was given; the name of a target, or three coordinates in mm, is accepted");
        const Aim aim(target, radius);
        with(i, [&](Episode& episode) {
            try {
                episode.aim(aim.of(episode.simulation().scenario()));
            } catch (const io::InputError&) {
                fill(i);  // it was reset before the target was judged
                throw;
            }
            fill(i);
        });
    }
    void apply(int i, const std::string& command) {
        with(i, [&](Episode& episode) {
            episode.ask(episode::parse_line(command));
            fill(i);
        });
    }
    py::array_t<std::uint64_t> hashes() {
        py::array_t<std::uint64_t> a(size());
        std::uint64_t* const to = a.mutable_data();
        in_parallel([&](int i, int) { to[i] = at(i).hash(); });
        return a;
    }
    std::string branch_name(int i) {
        return with(i, [](Episode& episode) {
            return episode.simulation()
                .anatomy()
                .branches[static_cast<std::size_t>(episode.reading().branch)]
                .name;
        });
    }
    std::string score(int i) {
        return with(i, [](Episode& episode) { return Simulation::score_of(episode); });
    }
    void save(int i, const std::filesystem::path& path) {
        with(i, [&](Episode& episode) { Simulation::save_to(path, episode); });
    }
    std::optional<double> way_from(int i, const py::object& given) {
        with(i, [](Episode&) {});
        const Vec3 place = checked_place(given, "place_mm");
        return with(i,
                    [&](Episode& episode) { return episode.reader().way_from(episode.simulation(), place); });
    }
    Snapshot snapshot(int i) {
        return with(i, [](Episode& episode) { return Snapshot{episode.snapshot()}; });
    }
    void restore(int i, const Snapshot& snapshot) {
        with(i, [&](Episode& episode) {
            episode.restore(snapshot.state);
            fill(i);
        });
    }

    py::array_t<std::uint8_t> images(int pixels, const std::string& mode,
                                     const std::optional<std::vector<std::uint64_t>>& seeds) {
        require_open();
        if (pixels < 32 || pixels > 2048) throw io::InputError("pixels: 32 to 2048 is accepted");
        if (seeds && static_cast<int>(seeds->size()) != size())
            throw io::InputError("seeds: one for each simulation is accepted");
        const episode::ImageMode as = mode_of(mode);
        py::array_t<std::uint8_t> a({size(), pixels, pixels});
        std::uint8_t* const to = a.mutable_data();
        in_parts(few * threads(), [&](int i, int thread) {
            episode::Camera& camera =
                cameras_[static_cast<std::size_t>(thread)].of(at(i).simulation(), cache_);
            const std::optional<std::uint64_t> seed =
                seeds ? std::optional((*seeds)[static_cast<std::size_t>(i)]) : std::nullopt;
            const render::GrayImage image =
                camera.image(at(i).simulation(), at(i).exercise().time(), at(i).arm(pixels), as, seed);
            std::copy(image.pixels.begin(), image.pixels.end(), to + image.pixels.size() * i);
        });
        return a;
    }
    py::array_t<std::uint8_t> panel(int i, int width, int height, const std::optional<std::uint64_t>& seed) {
        return array_of(with(i, [&](Episode& episode) {
            return episode.panel(panel_.of(width, height), &cameras_[0].of(episode.simulation(), cache_),
                                 seed);
        }));
    }
    py::dict masks(int pixels) {
        require_open();
        if (pixels < 32 || pixels > 2048) throw io::InputError("pixels: 32 to 2048 is accepted");
        py::dict all;
        bool catheter = false;
        {
            const py::gil_scoped_release free;
            const std::lock_guard lock(mutex_);
            for (const auto& episode : episodes_) catheter = catheter || episode->simulation().has_catheter();
        }
        std::map<std::string, std::uint8_t*> to;
        for (const char* name : {"wire", "vessels", "catheter"}) {
            if (!catheter && std::string(name) == "catheter") continue;
            py::array_t<std::uint8_t> a({size(), pixels, pixels});
            std::fill_n(a.mutable_data(), a.size(), std::uint8_t{0});
            to[name] = a.mutable_data();
            all[name] = a;
        }
        in_parts(few * threads(), [&](int i, int thread) {
            episode::Camera& camera =
                cameras_[static_cast<std::size_t>(thread)].of(at(i).simulation(), cache_);
            const auto& masks = camera.masks(at(i).simulation(), at(i).exercise().time(), at(i).arm(pixels));
            const auto put = [&](const char* name, const render::GrayImage& mask) {
                std::copy(mask.pixels.begin(), mask.pixels.end(), to.at(name) + mask.pixels.size() * i);
            };
            put("wire", masks.wire);
            put("vessels", masks.vessels);
            if (masks.catheter) put("catheter", *masks.catheter);
        });
        return all;
    }
    void close() {
        const py::gil_scoped_release free;
        const std::lock_guard lock(mutex_);
        episodes_.clear();
        for (Cameras& cameras : cameras_) cameras.clear();
    }
    bool closed() {
        const py::gil_scoped_release free;
        const std::lock_guard lock(mutex_);
        return episodes_.empty();
    }

private:
    /// Between two of these Ctrl-C is asked for: simulations whose state is touched, images of each thread.
    static constexpr int many = 1000, few = 8;

    static int checked_count(const char* what, int value, int most) {
        if (value < 1 || value > most)
            throw io::InputError(std::string(what) + ": " + std::to_string(value) + " was given; 1 to " +
                                 std::to_string(most) + " is accepted");
        return value;
    }
    void require_open() {
        if (closed()) throw_closed();
    }
    [[noreturn]] static void throw_closed() {
        throw io::InputError("the simulations are closed; open ones are accepted");
    }
    std::optional<Flags> checked_mask(const py::object& given, const char* what) const {
        if (given.is_none()) return {};
        const py::array any = py::array::ensure(given);
        if (any && any.dtype().kind() == 'b' && any.ndim() == 1 && any.shape(0) == size()) return Flags(any);
        throw io::InputError(std::string(what) + ": " + std::string(py::repr(given)) +
                             " was given; a mask, an array of " + std::to_string(size()) +
                             " truth values, is accepted");
    }
    Episode& at(int i) { return *episodes_[static_cast<std::size_t>(i)]; }
    Episode& checked_at(int i) {
        if (episodes_.empty()) throw_closed();
        if (i < 0 || i >= size())
            throw py::index_error("simulation " + std::to_string(i) + " of " + std::to_string(size()));
        return at(i);
    }
    /// Calls use(episode) of the i-th with the interpreter free and these simulations locked.
    template <class Use>
    std::invoke_result_t<const Use&, Episode&> with(int i, const Use& use) {
        const py::gil_scoped_release free;
        const std::lock_guard lock(mutex_);
        return use(checked_at(i));
    }
    /// Calls work(index, thread) for each in [first, end). One call at a time, with the interpreter free.
    template <class Work>
    void in_parallel(int first, int end, const Work& work) {
        const py::gil_scoped_release free;
        const std::lock_guard lock(mutex_);
        if (episodes_.empty()) throw_closed();
        pool_.run(end - first, [&](int i, int thread) { work(first + i, thread); });
    }
    template <class Work>
    void in_parallel(const Work& work) {
        in_parallel(0, size(), work);
    }
    /// The same in parts of so many, after each of which Ctrl-C ends the call.
    template <class Work>
    void in_parts(int part, const Work& work) {
        for (int first = 0; first < size(); first += part) {
            in_parallel(first, std::min(first + part, size()), work);
            check_signals();
        }
    }
    /// Where the arrays are, for threads that may not touch Python's objects.
    void bind() {
        for (auto& [name, array] : arrays_) doubles_[name] = array.mutable_data();
        for (auto& [name, array] : whole_) wholes_[name] = array.mutable_data();
        for (auto& [name, array] : flags_) bools_[name] = array.mutable_data();
        const auto d = [this](const char* name) { return doubles_.at(name); };
        to_ = {d("along_mm"),          d("path_to_target_mm"),
               d("tip_to_target_mm"),  d("tip_force_N"),
               d("wall_force_N"),      d("time_s"),
               d("target_radius_mm"),  d("tip_mm"),
               d("tip_direction"),     d("target_mm"),
               d("shift_mm"),          d("tip_px"),
               d("target_px"),         d("inserted_mm"),
               d("turned_rad"),        d("push_N"),
               d("torque_Nmm"),        d("track_mm"),
               d("track_px"),          d("air_kerma_mGy"),
               d("area_product_Gycm2")};
    }
    void fill(int i) {
        const Episode& episode = at(i);
        const exercise::Simulation& simulation = episode.simulation();
        const scenario::Scenario& scenario = simulation.scenario();
        const episode::Reading r = episode.reading();
        const render::CArm arm = episode.arm(scenario.c_arm.pixels);
        const auto put = [i](double* to, const Vec3& v) { std::copy_n(v.data(), 3, to + 3 * i); };
        const auto put_pixel = [&](double* to, const Vec3& v) {
            const render::Pixel pixel = render::project(arm, v);
            to[0] = pixel.x;
            to[1] = pixel.y;
        };
        to_.along[i] = r.along;
        to_.path[i] = r.path_to_target.value_or(std::numeric_limits<double>::quiet_NaN());
        to_.distance[i] = r.tip_to_target;
        to_.tip_force[i] = r.tip_force;
        to_.wall_force[i] = r.wall_force;
        to_.time[i] = r.time.seconds;
        to_.radius[i] = scenario.target.radius;
        to_.air_kerma[i] = r.air_kerma;
        to_.area_product[i] = r.area_product;
        put(to_.tip, r.tip);
        put(to_.direction, r.direction);
        put(to_.target, r.target);
        put(to_.shift, r.shift);
        put_pixel(to_.tip_px + 2 * i, r.tip);
        put_pixel(to_.target_px + 2 * i, r.target);
        for (int k = 0; k < devices; ++k) {
            const episode::Hand& hand = k == 0 ? r.wire : r.catheter;
            to_.inserted[devices * i + k] = hand.inserted;
            to_.turned[devices * i + k] = hand.turned;
            to_.push[devices * i + k] = hand.push;
            to_.torque[devices * i + k] = hand.torque;
        }
        std::vector<Vec3> track(static_cast<std::size_t>(points_));
        episode::track(
            simulation.path_of(scenario.target.by_catheter ? script::Held::Catheter : script::Held::Wire),
            spacing_, track);
        for (int k = 0; k < points_; ++k) {
            const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(points_) * i + k;
            const Vec3 place = track[static_cast<std::size_t>(k)] + r.shift;
            std::copy_n(place.data(), 3, to_.track + 3 * row);
            put_pixel(to_.track_px + 2 * row, place);
        }
        const auto whole = [&](const char* name, std::int64_t value) { wholes_.at(name)[i] = value; };
        whole("frame", r.time.attempt);
        whole("branch", r.branch);
        const auto flag = [&](const char* name, bool value) { bools_.at(name)[i] = value; };
        flag("settling", r.settling);
        flag("at_rest", r.at_rest);
        flag("certified", r.certified);
        flag("refused", r.refused);
        flag("buckled", r.buckled);
        flag("insertion_stopped", r.insertion_stopped);
        flag("withdrawal_stopped", r.withdrawal_stopped);
        flag("whole_wire_is_in", r.whole_wire_is_in);
        flag("too_thick", r.too_thick);
        flag("completed", r.completed);
        flag("on_target", r.on_target);
        flag("time_is_up", r.time_is_up);
    }

    int n_;
    std::vector<std::unique_ptr<Episode>> episodes_;  // none when closed
    episode::Pool pool_;
    std::vector<Cameras> cameras_;
    PanelOfSize panel_;
    int points_;
    double spacing_;
    anatomy::ModelCache cache_;
    std::mutex mutex_;
    std::map<std::string, py::array_t<double>> arrays_;
    std::map<std::string, py::array_t<std::int64_t>> whole_;
    std::map<std::string, py::array_t<bool>> flags_;
    std::map<std::string, double*> doubles_;
    std::map<std::string, std::int64_t*> wholes_;
    std::map<std::string, bool*> bools_;
    struct {
        double *along, *path, *distance, *tip_force, *wall_force, *time, *radius, *tip, *direction, *target,
            *shift, *tip_px, *target_px, *inserted, *turned, *push, *torque, *track, *track_px, *air_kerma,
            *area_product;
    } to_ = {};
};

void write_png(const std::filesystem::path& path, const py::object& given) {
    const py::array any = py::array::ensure(given);
    const char kind = any ? any.dtype().kind() : ' ';
    const bool colour = any && any.ndim() == 3 && any.shape(2) == 3;
    if (!any || !(kind == 'b' || (kind == 'u' && any.itemsize() == 1)) || !(any.ndim() == 2 || colour) ||
        any.size() == 0)
        throw io::InputError("image: " +
                             (any ? "an array of " + std::string(py::str(any.dtype())) + " and shape " +
                                        std::string(py::str(any.attr("shape")))
                                  : std::string(py::repr(py::type::of(given)))) +
                             " was given; one of uint8 or bool of shape (H, W) or (H, W, 3) is accepted");
    const py::array_t<std::uint8_t, py::array::c_style | py::array::forcecast> image(any);
    const auto height = static_cast<int>(image.shape(0)), width = static_cast<int>(image.shape(1));
    std::vector<std::uint8_t> pixels(image.data(), image.data() + image.size());
    if (kind == 'b')
        for (std::uint8_t& pixel : pixels) pixel = pixel != 0 ? 255 : 0;
    const std::vector<std::uint8_t> bytes =
        colour ? render::encode_png(render::ColourImage{width, height, std::move(pixels)})
               : render::encode_png(render::GrayImage{width, height, std::move(pixels)});
    io::write_whole(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace

PYBIND11_MODULE(_core, m) {
    m.doc() = "The engine of Seldinger. Use the package 'seldinger', which documents it.";
    m.attr("__version__") = SELDINGER_VERSION;
    py::register_exception<io::InputError>(m, "InputError", PyExc_ValueError).attr("__doc__") =
        docs::input_error;
    m.attr("InputError").attr("__module__") = "seldinger";

    const auto value = [](auto member) { return [member](const State& s) { return s.reading.*member; }; };
    using episode::Reading;
    py::class_<State> state(m, "State", docs::state);
    state
        .def_property_readonly(
            "frame", [](const State& s) { return s.reading.time.attempt; }, docs::frame)
        .def_property_readonly(
            "time_s", [](const State& s) { return s.reading.time.seconds; }, docs::time)
        .def_readonly("tip_mm", &State::tip, docs::tip)
        .def_readonly("tip_direction", &State::direction, docs::direction)
        .def_readonly("tip_px", &State::tip_px, docs::tip_px)
        .def_readonly("target_mm", &State::target, docs::target)
        .def_readonly("target_px", &State::target_px, docs::target_px)
        .def_readonly("branch", &State::branch, docs::branch)
        .def_property_readonly("along_mm", value(&Reading::along), docs::along)
        .def_property_readonly(
            "path_to_target_mm",
            [](const State& s) {
                return s.reading.path_to_target.value_or(std::numeric_limits<double>::quiet_NaN());
            },
            docs::path)
        .def_property_readonly("tip_to_target_mm", value(&Reading::tip_to_target), docs::distance)
        .def_readonly("wire_mm", &State::wire, docs::wire)
        .def_readonly("wire_px", &State::wire_px, docs::wire_px)
        .def_readonly("catheter_mm", &State::catheter, docs::catheter)
        .def_readonly("catheter_px", &State::catheter_px, docs::catheter_px)
        .def_readonly("joint_force_N", &State::force, docs::force)
        .def_property_readonly("tip_force_N", value(&Reading::tip_force), docs::tip_force)
        .def_property_readonly("wall_force_N", value(&Reading::wall_force), docs::wall_force)
        .def_property_readonly("air_kerma_mGy", value(&Reading::air_kerma), docs::air_kerma)
        .def_property_readonly("area_product_Gycm2", value(&Reading::area_product), docs::area_product)
        .def_readonly("hash", &State::hash, docs::hash);
    const auto hand = [&](const char* name, episode::Hand Reading::*which, double episode::Hand::*what,
                          double unit, const char* doc) {
        state.def_property_readonly(
            name, [which, what, unit](const State& s) { return s.reading.*which.*what / unit; }, doc);
    };
    using episode::Hand;
    hand("inserted_mm", &Reading::wire, &Hand::inserted, 1, docs::inserted);
    hand("turned_deg", &Reading::wire, &Hand::turned, geometry::degree, docs::turned);
    hand("push_N", &Reading::wire, &Hand::push, 1, docs::push);
    hand("torque_Nmm", &Reading::wire, &Hand::torque, 1, docs::torque);
    hand("catheter_inserted_mm", &Reading::catheter, &Hand::inserted, 1, docs::inserted);
    hand("catheter_turned_deg", &Reading::catheter, &Hand::turned, geometry::degree, docs::turned);
    hand("catheter_push_N", &Reading::catheter, &Hand::push, 1, docs::push);
    hand("catheter_torque_Nmm", &Reading::catheter, &Hand::torque, 1, docs::torque);
    const auto flag = [&](const char* name, bool Reading::*which, const char* doc) {
        state.def_property_readonly(
            name, [which](const State& s) { return s.reading.*which; }, doc);
    };
    flag("settling", &Reading::settling, docs::settling);
    flag("at_rest", &Reading::at_rest, docs::at_rest);
    flag("certified", &Reading::certified, docs::certified);
    flag("refused", &Reading::refused, docs::refused);
    flag("buckled", &Reading::buckled, docs::buckled);
    flag("too_thick", &Reading::too_thick, docs::too_thick);
    flag("insertion_stopped", &Reading::insertion_stopped, docs::insertion_stopped);
    flag("withdrawal_stopped", &Reading::withdrawal_stopped, docs::withdrawal_stopped);
    flag("whole_wire_is_in", &Reading::whole_wire_is_in, docs::whole_wire_is_in);
    flag("completed", &Reading::completed, docs::completed);
    flag("on_target", &Reading::on_target, docs::on_target);
    flag("time_is_up", &Reading::time_is_up, docs::time_is_up);

    py::class_<Snapshot>(m, "Snapshot", docs::snapshot).def("__len__", [](const Snapshot& s) {
        return s.state.exercise.state.size();
    });

    py::class_<Simulation>(m, "Simulation")
        .def(py::init<const std::string&, const std::optional<std::string>&, const std::string&,
                      const Overrides&, const std::string&, const std::string&, bool>(),
             py::arg("file"), py::arg("text"), py::arg("devices"), py::arg("overrides"), py::arg("images"),
             py::arg("cache"), py::arg("panel"))
        .def("step", &Simulation::step, py::arg("advance_mm") = 0.0, py::arg("rotate_deg") = 0.0,
             py::kw_only(), py::arg("device") = "wire", py::arg("catheter_advance_mm") = 0.0,
             py::arg("catheter_rotate_deg") = 0.0, py::arg("frames") = 1, docs::step)
        .def("apply", &Simulation::apply, py::arg("command"), docs::apply)
        .def_property_readonly("state", &Simulation::state, docs::state_now)
        .def("reset", &Simulation::reset, py::kw_only(), py::arg("target") = py::none(),
             py::arg("radius_mm") = py::none(), docs::reset)
        .def("snapshot", &Simulation::snapshot, docs::take_snapshot)
        .def("restore", &Simulation::restore, py::arg("snapshot"), docs::restore)
        .def("image", &Simulation::image, py::arg("pixels") = py::none(), py::arg("mode") = "live",
             py::kw_only(), py::arg("seed") = py::none(), docs::image)
        .def("panel", &Simulation::panel, py::arg("width") = 1280, py::arg("height") = 1024, py::kw_only(),
             py::arg("seed") = py::none(), docs::panel)
        .def("masks", &Simulation::masks, py::arg("pixels") = py::none(), docs::masks)
        .def("project", &Simulation::project, py::arg("places_mm"), py::arg("pixels") = py::none(),
             docs::project)
        .def("camera_matrix", &Simulation::camera_matrix, py::arg("pixels") = py::none(), docs::camera_matrix)
        .def("_score", &Simulation::score)
        .def("save", &Simulation::save, py::arg("path"), docs::save)
        .def("close", &Simulation::close, docs::close)
        .def_property_readonly("closed", &Simulation::closed, docs::closed)
        .def("_copy", &Simulation::copy)
        .def("anatomy", &Simulation::anatomy, docs::anatomy)
        .def("about", &Simulation::about, docs::about)
        .def("path_from", &Simulation::way_from, py::arg("place_mm"), docs::path_from);

    py::class_<VectorSimulation>(m, "VectorSimulation")
        .def(py::init<Simulation&, int, int, int, double>(), py::arg("like"), py::arg("n"),
             py::arg("threads"), py::arg("points"), py::arg("spacing_mm"))
        .def("__len__", &VectorSimulation::size)
        .def_property_readonly("threads", &VectorSimulation::threads, docs::threads)
        .def_property_readonly("_arrays", &VectorSimulation::arrays)
        .def("step", &VectorSimulation::step, py::arg("motions"), py::kw_only(), py::arg("frames") = 1,
             py::arg("active") = py::none(), docs::vector_step)
        .def("reset", &VectorSimulation::reset, py::arg("which") = py::none(), docs::vector_reset)
        .def("assign", &VectorSimulation::assign, py::arg("i"), py::arg("like"), docs::assign)
        .def("aim", &VectorSimulation::aim, py::arg("i"), py::arg("target"),
             py::arg("radius_mm") = py::none(), docs::aim)
        .def("apply", &VectorSimulation::apply, py::arg("i"), py::arg("command"), docs::vector_apply)
        .def("hashes", &VectorSimulation::hashes, docs::hashes)
        .def("branch_name", &VectorSimulation::branch_name, py::arg("i"), docs::branch_name)
        .def("_score", &VectorSimulation::score, py::arg("i"))
        .def("save", &VectorSimulation::save, py::arg("i"), py::arg("path"), docs::vector_save)
        .def("path_from", &VectorSimulation::way_from, py::arg("i"), py::arg("place_mm"), docs::path_from)
        .def("snapshot", &VectorSimulation::snapshot, py::arg("i"), docs::take_snapshot)
        .def("restore", &VectorSimulation::restore, py::arg("i"), py::arg("snapshot"), docs::restore)
        .def("images", &VectorSimulation::images, py::arg("pixels"), py::arg("mode") = "live", py::kw_only(),
             py::arg("seeds") = py::none(), docs::images)
        .def("panel", &VectorSimulation::panel, py::arg("i"), py::arg("width") = 1280,
             py::arg("height") = 1024, py::kw_only(), py::arg("seed") = py::none(), docs::panel)
        .def("masks", &VectorSimulation::masks, py::arg("pixels"), docs::vector_masks)
        .def("close", &VectorSimulation::close, docs::vector_close)
        .def_property_readonly("closed", &VectorSimulation::closed, docs::closed);

    m.def("_facts", &facts, py::arg("file"), py::arg("text"), py::arg("devices"), py::arg("overrides"));
    m.def("write_png", &write_png, py::arg("path"), py::arg("image"), docs::write_png);
}

}  // namespace app
