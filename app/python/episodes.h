#pragma once
/// Episodes that Python holds: one, whose states are objects, or many, whose states are one array.

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <fmt/format.h>
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

#include "app/python/free.h"
#include "app/python/values.h"
#include "engine/episode/episode.h"
#include "engine/episode/pool.h"
#include "engine/episode/store.h"
#include "engine/exercise/score_file.h"
#include "engine/io/error.h"
#include "engine/io/files.h"

namespace app {

/// The panel in the size that was asked for last.
class PanelOfSize {
public:
    render::Panel& of(int width, int height) {
        if (width < 640 || width > 4096 || height < 512 || height > 4096)
            throw io::InputError("panel: {} x {} pixels were asked for; expected 640 x 512 to 4096 x 4096",
                                 width, height);
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

/// What scenarios that take turns in one environment must have in common. No vessels are grown for it.
inline py::dict facts(const std::string& file, const std::optional<std::string>& text,
                      const std::string& catalogue, const Overrides& overrides) {
    const scenario::Scenario scenario = episode::scenario_of({file, text, catalogue, overrides});
    py::dict made;
    py::list names;
    for (const scenario::PlacedDevice& placed : scenario.devices) names.append(std::string(placed.name()));
    made["devices"] = scenario.devices.size();
    made["device_names"] = names;
    made["frame_rate_hz"] = scenario.frame_rate;
    made["pixels"] = scenario.c_arm.pixels;
    return made;
}

/// Episodes that Python holds, one or many. Made by its default constructor it has none, and every call is
/// refused until open() was called.
class Episodes {
public:
    virtual ~Episodes() = default;

    int size() const {
        require_made();
        return n_;
    }
    void apply(int i, const std::string& command) {
        with(i, [&](Episode& episode) {
            episode.ask(episode::parse_line(command));
            changed(i);
        });
    }
    void aim(int i, const py::object& target, const std::optional<double>& radius) {
        with(i, [](Episode&) {});
        const Aim aim(target, radius);
        with(i, [&](Episode& episode) {
            try {
                episode.aim(aim.of(episode.simulation().scenario()));
            } catch (const io::InputError&) {
                changed(i);  // it was reset before the target was judged
                throw;
            }
            changed(i);
        });
    }
    Snapshot snapshot(int i) {
        return with(i, [](Episode& episode) { return Snapshot{episode.snapshot()}; });
    }
    void restore(int i, const Snapshot& snapshot) {
        with(i, [&](Episode& episode) {
            episode.restore(snapshot.state);
            changed(i);
        });
    }
    py::array_t<std::uint8_t> panel(int i, int width, int height, const std::optional<std::uint64_t>& seed) {
        return array_of(with(i, [&](Episode& episode) {
            return episode.panel(panel_.of(width, height), camera_of(episode), seed);
        }));
    }
    std::string score(int i) {
        return with(i, [](Episode& episode) {
            const exercise::Exercise& exercise = episode.exercise();
            return exercise::to_json({program(),
                                      {},
                                      exercise.finish(),
                                      exercise.earlier_attempts(),
                                      exercise.simulation().scenario().lesson.benchmark});
        });
    }
    void save(int i, const std::filesystem::path& path) {
        script::Origin origin;
        origin.program = program();
        with(i, [&](Episode& episode) { episode.save(path, origin); });
    }
    std::optional<double> path_length_from(int i, const py::object& given) {
        with(i, [](Episode&) {});
        const Vec3 place = checked_place(given, "place_mm");
        return with(i, [&](Episode& episode) {
            return episode.reader().path_length_from(episode.simulation(), place);
        });
    }
    /// (name or None, place or None, radius) that the i-th aims at.
    py::tuple target(int i) {
        const scenario::Target target =
            with(i, [](Episode& episode) { return episode.simulation().scenario().target; });
        return py::make_tuple(target.name.empty() ? py::object(py::none()) : py::str(target.name),
                              target.centre ? py::object(array_of(*target.centre)) : py::none(),
                              target.radius);
    }
    void close() {
        alone([&] {
            episodes_.clear();
            forget();
        });
    }
    bool closed() {
        require_made();
        return alone([&] { return episodes_.empty(); });
    }
    const anatomy::ModelCache& cache() const { return cache_; }

    /// Calls use(episode) of the i-th with the interpreter free and all of these locked. No object of Python
    /// may be made or let go in it.
    template <class Use>
    std::invoke_result_t<const Use&, Episode&> with(int i, const Use& use) {
        return alone([&] { return use(checked_at(i)); });
    }
    static std::unique_ptr<Episode> beside(const Episode& episode) {
        if (episode.exercise().monitor())
            throw io::InputError(
                "a simulation with images=True cannot be shared; expected one with False or 'dose'");
        return std::make_unique<Episode>(episode);
    }

protected:
    /// To be called once, with a Making.
    void made(std::vector<std::unique_ptr<Episode>> episodes, anatomy::ModelCache cache) {
        alone([&] {
            episodes_ = std::move(episodes);
            cache_ = std::move(cache);
            n_ = static_cast<int>(episodes_.size());
        });
    }
    /// Calls use() with the interpreter free and all of these locked.
    template <class Use>
    std::invoke_result_t<const Use&> alone(const Use& use) {
        const Free free;
        const std::lock_guard lock(mutex_);
        return use();
    }
    /// To be held by the constructor in Python, of which two threads may call two at a time.
    class Making {
    public:
        explicit Making(Episodes& of) : of_(of) {
            if (of.n_ > 0 || of.making_.exchange(true))
                throw io::InputError("__init__: expected one call, found a second one");
        }
        ~Making() { of_.making_ = false; }
        Making(const Making&) = delete;
        Making& operator=(const Making&) = delete;

    private:
        Episodes& of_;
    };
    void require_made() const {
        if (n_ == 0)
            throw io::InputError(
                "expected an object that was made, found one before its __init__(): a class "
                "derived from it calls super().__init__() first");
    }
    void require_open() {
        if (closed()) throw_closed();
    }
    [[noreturn]] void throw_closed() const {
        require_made();
        throw io::InputError(n_ == 1 ? "the simulation is closed; expected one that is open"
                                     : "the simulations are closed; expected open ones");
    }
    Episode& at(int i) { return *episodes_[static_cast<std::size_t>(i)]; }
    Episode& checked_at(int i) {
        if (episodes_.empty()) throw_closed();
        if (i < 0 || i >= n_)
            throw py::index_error("simulation " + std::to_string(i) + " of " + std::to_string(n_));
        return at(i);
    }
    /// What follows from the state of the i-th is to be brought up to date.
    virtual void changed(int) {}
    virtual episode::Camera* camera_of(Episode&) { return nullptr; }  // of its own
    virtual void forget() {}
    static std::string program() { return "seldinger " SELDINGER_VERSION; }
    static void require_frames(int frames) {
        if (frames < 1 || frames > script::largest_frame)
            throw io::InputError("frames: {} was given; expected 1 to {}", frames, script::largest_frame);
    }

    std::atomic<int> n_ = 0;  // 0 = not made yet
    std::atomic<bool> making_ = false;
    std::vector<std::unique_ptr<Episode>> episodes_;  // none when closed
    anatomy::ModelCache cache_;
    PanelOfSize panel_;
    std::mutex mutex_;
};

/// One episode, whose states are objects.
class Simulation : public Episodes {
public:
    Simulation() = default;

    void open(const std::string& file, const std::optional<std::string>& text, const std::string& catalogue,
              const Overrides& overrides, const std::string& images, const std::string& cache_folder,
              bool panel) {
        const Making making(*this);
        exercise::Pictures pictures;
        if (images == "none")
            pictures = exercise::Pictures::None;
        else if (images == "dose")
            pictures = exercise::Pictures::Dose;
        else if (images == "all")
            pictures = exercise::Pictures::All;
        else
            throw io::InputError("images: '" + images + "' was given; expected False, 'dose' or True");
        anatomy::ModelCache cache;
        cache.folder = cache_folder;
        cache.progress = [](double, const char*) { look_after_python(); };
        std::vector<std::unique_ptr<Episode>> episodes;
        {
            const Free free;
            episodes.push_back(episode::open({file, text, catalogue, overrides, pictures, panel}, cache));
        }
        made(std::move(episodes), std::move(cache));
    }
    /// Becomes another one like it, at its start.
    void open_like(Simulation& like) {
        const Making making(*this);
        std::vector<std::unique_ptr<Episode>> episodes(1);
        like.with(0, [&](Episode& episode) { episodes[0] = beside(episode); });
        made(std::move(episodes), like.cache());
    }

    State state() {
        return state_of(with(0, [](const Episode& episode) { return read(episode); }));
    }
    State step(double advance, double rotate, const py::object& device, double catheter_advance,
               double catheter_rotate, int frames) {
        require_frames(frames);
        const script::DeviceRole held =
            held_of(device, with(0, [](const Episode& episode) { return roles_of(episode.simulation()); }));
        checked(advance, largest_motion, "advance_mm", "mm");
        checked(rotate, largest_rotation, "rotate_deg", "deg");
        checked(catheter_advance, largest_motion, "catheter_advance_mm", "mm");
        checked(catheter_rotate, largest_rotation, "catheter_rotate_deg", "deg");
        std::vector<script::Command> commands;
        episode::append(held, advance, rotate * geometry::degree, commands);
        episode::append(script::DeviceRole::Catheter, catheter_advance, catheter_rotate * geometry::degree,
                        commands);
        for (int frame = 0; frame < frames; ++frame) {
            with(0, [&](Episode& episode) { episode.step(commands); });
            check_signals();
        }
        return state();
    }
    State reset(const py::object& target, const std::optional<double>& radius) {
        if (target.is_none() && !radius)
            with(0, [](Episode& episode) { episode.reset(); });
        else
            aim(0, target, radius);
        return state();
    }

    py::array_t<std::uint8_t> image(const std::optional<int>& pixels, const std::string& mode,
                                    const std::optional<std::uint64_t>& seed) {
        const episode::ImageMode as = mode_of(mode);
        return array_of(
            with(0, [&](Episode& episode) { return episode.image(size_of(episode, pixels), as, seed); }));
    }
    py::dict masks(const std::optional<int>& pixels) {
        Roles roles;
        const episode::Camera::Masks made = with(0, [&](Episode& episode) {
            roles = roles_of(episode.simulation());
            return episode.masks(size_of(episode, pixels));
        });
        py::dict masks;
        for (std::size_t k = 0; k < made.devices.size(); ++k)
            masks[std::string(script::name_of(roles[k])).c_str()] = array_of(made.devices[k]);
        masks["vessels"] = array_of(made.vessels);
        if (made.extravasation) masks["extravasation"] = array_of(*made.extravasation);
        if (made.stents) masks["stent"] = array_of(*made.stents);
        return masks;
    }
    Doubles project(const Doubles& places, const std::optional<int>& pixels) {
        if (places.ndim() != 2 || places.shape(1) != 3)
            throw io::InputError("places_mm: expected an array of shape (n, 3)");
        const render::CArm arm = arm_of(pixels);
        Doubles a({places.shape(0), py::ssize_t{2}});
        for (py::ssize_t i = 0; i < places.shape(0); ++i) {
            const render::Pixel pixel = render::project(arm, Vec3(places.data(i, 0)));
            a.mutable_at(i, 0) = pixel.x;
            a.mutable_at(i, 1) = pixel.y;
        }
        return a;
    }
    Doubles camera_matrix(const std::optional<int>& pixels) {
        const Eigen::Matrix<double, 3, 4, Eigen::RowMajor> camera = render::camera_matrix(arm_of(pixels));
        return Doubles({3, 4}, camera.data());
    }

    py::dict anatomy() {
        const anatomy::Anatomy anatomy =
            with(0, [](const Episode& episode) { return episode.simulation().anatomy(); });
        py::dict made;
        made["name"] = anatomy.name;
        py::list branches, ends, targets;
        for (const auto& branch : anatomy.branches) {
            py::dict one;
            one["name"] = branch.name;
            one["parent"] = branch.parent;
            one["points_mm"] = array_of(branch.points);
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
        made["vertices_mm"] = array_of(anatomy.lumen.vertices);
        return made;
    }
    py::dict about() {
        const scenario::Scenario s =
            with(0, [](const Episode& episode) { return episode.simulation().scenario(); });
        py::dict made;
        made["name"] = s.name;
        made["title"] = s.title;
        made["frame_rate_hz"] = s.frame_rate;
        made["time_limit_s"] = s.time_limit ? py::object(py::float_(*s.time_limit)) : py::none();
        made["devices"] = s.devices.size();
        py::list names, lengths, diameters;
        for (const scenario::PlacedDevice& placed : s.devices) {
            names.append(std::string(placed.name()));
            lengths.append(placed.device.length);
            diameters.append(placed.device.outer_diameter);
        }
        made["device_names"] = names;
        made["device_lengths_mm"] = lengths;
        made["device_diameters_mm"] = diameters;
        made["target_by"] = std::string(script::name_of(s.target.device));
        made["target_radius_mm"] = s.target.radius;
        made["pixels"] = s.c_arm.pixels;
        made["field_mm"] = s.c_arm.detector_width * s.c_arm.sod / s.c_arm.sid;
        made["lao_deg"] = s.c_arm.lao / geometry::degree;
        made["cranial_deg"] = s.c_arm.cranial / geometry::degree;
        made["wire_length_mm"] = s.wire().device.length;
        return made;
    }

private:
    static int size_of(const Episode& episode, const std::optional<int>& pixels) {
        return pixels.value_or(episode.simulation().scenario().c_arm.pixels);
    }
    render::CArm arm_of(const std::optional<int>& pixels) {
        return with(0, [&](const Episode& episode) { return episode.arm(size_of(episode, pixels)); });
    }
};

/// Cameras of one thread, one for each patient that was imaged last.
class Cameras {
public:
    episode::Camera& of(const Episode& episode, const anatomy::ModelCache& cache) {
        for (Kept& kept : kept_)
            if (kept.patient == episode.patient()) return *kept.camera;
        auto camera = std::make_unique<episode::Camera>(episode.patient(), cache);
        if (kept_.size() == most) kept_.erase(kept_.begin());
        kept_.push_back({episode.patient(), std::move(camera)});
        return *kept_.back().camera;
    }
    void clear() { kept_.clear(); }

private:
    static constexpr std::size_t most = 4;
    struct Kept {
        std::shared_ptr<episode::PatientImages> patient;
        std::unique_ptr<episode::Camera> camera;
    };
    std::vector<Kept> kept_;
};

/// Many episodes on a pool of threads, whose states are records of one array.
class VectorSimulation : public Episodes {
public:
    VectorSimulation() = default;

    void open(Simulation& like, int n, int threads, int points, double spacing) {
        const Making making(*this);
        checked_count("n", n, 100'000);
        checked_count("threads", threads, 256);
        checked_count("points", points, 1000);
        checked_spacing(spacing);
        std::vector<std::unique_ptr<Episode>> episodes;
        while (static_cast<int>(episodes.size()) < n) {
            like.with(0, [&](Episode& episode) {
                for (int k = 0; k < 100 && static_cast<int>(episodes.size()) < n; ++k)
                    episodes.push_back(beside(episode));
            });
            check_signals();
        }
        pool_.emplace(threads);
        cameras_ = std::vector<Cameras>(static_cast<std::size_t>(threads));
        points_ = points;
        spacing_ = spacing;
        records_ = py::array(record(), n);
        track_ = py::array_t<double>({n, points, 3});
        track_px_ = py::array_t<double>({n, points, 2});
        tracks_ = py::array_t<double>({n, script::most_devices, points, 3});
        tracks_px_ = py::array_t<double>({n, script::most_devices, points, 2});
        c_arm_ = py::array_t<double>({n, 2});
        table_ = py::array_t<double>({n, 3});
        for (py::array_t<double>* array : {&tracks_, &tracks_px_})
            std::fill_n(array->mutable_data(), array->size(), 0.0);
        // Where they are, for threads that may not touch Python's objects.
        readings_ = static_cast<Observation*>(records_.mutable_data());
        of_target_ = {track_.mutable_data(), track_px_.mutable_data()};
        of_devices_ = {tracks_.mutable_data(), tracks_px_.mutable_data()};
        angles_ = c_arm_.mutable_data();
        shifts_ = table_.mutable_data();
        made(std::move(episodes), like.cache());
        in_parts(many, [&](int i, int) { changed(i); });
    }

    int threads() const {
        require_made();
        return pool_->threads();
    }
    py::dict arrays() {
        require_made();
        py::dict all;
        const int n = n_, devices = alone([&] { return most_devices(); });
        const auto of_each = [&](const py::object& column) {
            return py::object(column[py::make_tuple(py::slice(0, n, 1), py::slice(0, devices, 1))]);
        };
        for (const exercise::Field& field : exercise::fields())
            if (const std::string name(field.name); !name.empty()) {
                const py::object column = records_[name.c_str()];
                all[name.c_str()] = kind_of(field).devices ? of_each(column) : column;
            }
        all["readings"] = records_;
        all["track_mm"] = track_;
        all["track_px"] = track_px_;
        all["tracks_mm"] = of_each(tracks_);
        all["tracks_px"] = of_each(tracks_px_);
        all["c_arm_deg"] = c_arm_;
        all["table_mm"] = table_;
        return all;
    }

    void step(const Doubles& motions, int frames, const py::object& active) {
        require_open();
        const int most = alone([&] { return most_devices(); });
        if (motions.ndim() != 3 || motions.shape(0) != size() || motions.shape(1) < 1 ||
            motions.shape(1) > most || motions.shape(2) != 2)
            throw io::InputError(refused_shape(motions));
        require_frames(frames);
        const std::optional<Flags> mask = checked_mask(active, "active");
        const bool* const on = mask ? mask->data() : nullptr;
        const auto of = static_cast<int>(motions.shape(1));
        const double* const data = motions.data();
        for (py::ssize_t k = 0; k < motions.size(); ++k)
            checked(data[k], k % 2 == 0 ? largest_motion : largest_rotation * geometry::degree, "motions",
                    k % 2 == 0 ? "mm" : "rad");
        if (of > 1) {
            alone([&] {
                for (int i = 0; i < size(); ++i) {
                    const double* const m = data + static_cast<std::ptrdiff_t>(i) * of * 2;
                    const auto there = static_cast<int>(checked_at(i).simulation().devices().size());
                    if ((on && !on[i]) || there >= of) continue;
                    if (std::all_of(m + 2 * there, m + 2 * of, [](double x) { return x == 0; })) continue;
                    throw io::InputError(
                        "simulation {}: expected motions of its devices alone, or 0, found one of device {}; "
                        "the scenario has {}",
                        i, there, devices_of(roles_of(checked_at(i).simulation())));
                }
            });
        }
        for (int frame = 0; frame < frames; ++frame) {
            in_parallel([&](int i, int) {
                if (on && !on[i]) return;
                const double* const m = data + static_cast<std::ptrdiff_t>(i) * of * 2;
                std::vector<script::Command> commands;
                const auto devices = at(i).simulation().devices();
                for (std::size_t k = 0; k < std::min<std::size_t>(devices.size(), of); ++k)
                    episode::append(devices[k].role, m[2 * k], m[2 * k + 1], commands);
                at(i).step(commands);
                if (frame + 1 == frames) changed(i);
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
            changed(i);
        });
    }
    /// Points on the ways to the targets, in mm and in pixels.
    py::tuple route(int points, double spacing) {
        require_open();
        checked_count("points", points, 1000);
        checked_spacing(spacing);
        const int n = n_;
        py::array_t<double> places({n, points, 3}), pixels({n, points, 2});
        const Tracks to{places.mutable_data(), pixels.mutable_data()};
        in_parts(many, [&](int i, int) {
            const Episode& episode = at(i);
            const exercise::Simulation& simulation = episode.simulation();
            std::vector<Vec3> ahead(static_cast<std::size_t>(points));
            const auto held = simulation.scenario().target.device;
            episode.reader().points_to_target(simulation, simulation.tip_of(held).at, spacing, ahead);
            for (Vec3& x : ahead) x = simulation.place_now(x);
            write(ahead, episode.arm(simulation.scenario().c_arm.pixels), to,
                  static_cast<std::ptrdiff_t>(i) * points);
        });
        return py::make_tuple(places, pixels);
    }
    void assign(int i, Simulation& like) {
        with(i, [](Episode&) {});
        std::unique_ptr<Episode> made;
        like.with(0, [&](Episode& episode) { made = beside(episode); });
        with(i, [&](Episode&) {
            episodes_[static_cast<std::size_t>(i)].swap(made);
            changed(i);
        });
    }
    void aim(int i, const py::object& target, const std::optional<double>& radius) {
        if (target.is_none())
            throw io::InputError(
                "target: None was given; expected the name of a target, or three coordinates in mm");
        Episodes::aim(i, target, radius);
    }
    py::array_t<std::uint64_t> hashes(bool asked) {
        py::array_t<std::uint64_t> a(size());
        std::uint64_t* const to = a.mutable_data();
        in_parallel([&](int i, int) {
            to[i] = at(i).hash();
            if (!asked) return;
            geometry::Vec3 target = at(i).simulation().target();
            double radius = at(i).simulation().scenario().target.radius;
            geometry::StateHash hash;
            hash(to[i], target, radius);
            for (const script::Command& command : at(i).asked()) {
                std::string text = script::to_text(command);
                hash(text);
            }
            to[i] = hash.value();
        });
        return a;
    }
    void show_tip(int i, double margin) {
        with(i, [&](Episode& episode) {
            episode.show_tip(margin);
            changed(i);
        });
    }
    std::string branch_name(int i) {
        return with(i, [&](Episode& episode) {
            return name_of(readings_[i].branch, episode.simulation().anatomy());
        });
    }

    py::array_t<std::uint8_t> images(int pixels, const std::string& mode,
                                     const std::optional<std::vector<std::uint64_t>>& seeds) {
        require_open();
        require_pixels(pixels);
        if (seeds && static_cast<int>(seeds->size()) != size())
            throw io::InputError("seeds: expected one for each simulation");
        const episode::ImageMode as = mode_of(mode);
        py::array_t<std::uint8_t> a({size(), pixels, pixels});
        std::uint8_t* const to = a.mutable_data();
        in_parts(few * threads(), [&](int i, int thread) {
            const std::optional<std::uint64_t> seed =
                seeds ? std::optional((*seeds)[static_cast<std::size_t>(i)]) : std::nullopt;
            const render::GrayImage image =
                camera_of(at(i), thread)
                    .image(at(i).simulation(), at(i).exercise().time(), at(i).arm(pixels), as, seed);
            std::copy(image.pixels.begin(), image.pixels.end(), to + image.pixels.size() * i);
        });
        return a;
    }
    py::dict masks(int pixels) {
        require_open();
        require_pixels(pixels);
        const auto zeros = [&] {
            py::array_t<std::uint8_t> a({size(), pixels, pixels});
            std::fill_n(a.mutable_data(), a.size(), std::uint8_t{0});
            return a;
        };
        py::array_t<std::uint8_t> vessels = zeros();
        std::uint8_t* const to_vessels = vessels.mutable_data();
        std::array<std::uint8_t*, script::most_devices> to_device = {};  // by role
        py::dict all;
        std::array<bool, script::most_devices> there = {};
        alone([&] {
            for (const auto& episode : episodes_)
                for (const script::DeviceRole role : roles_of(episode->simulation()))
                    there[static_cast<std::size_t>(role)] = true;
        });
        for (int k = 0; k < script::most_devices; ++k) {
            const auto role = static_cast<script::DeviceRole>(k);
            if (!there[static_cast<std::size_t>(k)]) continue;
            py::array_t<std::uint8_t> mask = zeros();
            to_device[static_cast<std::size_t>(k)] = mask.mutable_data();
            all[std::string(script::name_of(role)).c_str()] = mask;
        }
        all["vessels"] = vessels;
        in_parts(few * threads(), [&](int i, int thread) {
            const auto& masks = camera_of(at(i), thread)
                                    .masks(at(i).simulation(), at(i).exercise().time(), at(i).arm(pixels));
            const auto put = [&](std::uint8_t* all_of, const render::GrayImage& mask) {
                std::copy(mask.pixels.begin(), mask.pixels.end(), all_of + mask.pixels.size() * i);
            };
            put(to_vessels, masks.vessels);
            for (std::size_t k = 0; k < masks.devices.size(); ++k) {
                std::uint8_t* const to =
                    to_device[static_cast<std::size_t>(at(i).simulation().devices()[k].role)];
                if (!to) throw io::InputError("masks: expected no assignment by another thread meanwhile");
                put(to, masks.devices[k]);
            }
        });
        return all;
    }

private:
    /// What is said of motions of another shape than (simulations, devices, 2).
    std::string refused_shape(const Doubles& motions) {
        std::string found;
        for (py::ssize_t k = 0; k < motions.ndim(); ++k)
            found += (k == 0 ? "" : ", ") + std::to_string(motions.shape(k));
        if (motions.ndim() == 1) found += ",";
        const Roles most = alone([&] { return most_roles(); });
        return fmt::format(
            "motions: expected an array of shape ({}, {}{}, 2), mm and rad of each device, found ({}); the "
            "devices are {}",
            size(), most.size() == 1 ? "" : "1 to ", most.size(), found, devices_of(most));
    }
    /// The devices of the simulation that has most.
    Roles most_roles() {
        Roles most = {script::DeviceRole::Wire};
        for (const auto& episode : episodes_)
            if (Roles roles = roles_of(episode->simulation()); roles.size() > most.size())
                most = std::move(roles);
        return most;
    }
    int most_devices() { return static_cast<int>(most_roles().size()); }
    /// Between two of these Ctrl-C is asked for: simulations whose state is touched, images of each thread.
    static constexpr int many = 1000, few = 8;

    static void require_pixels(int pixels) {
        if (pixels < 32 || pixels > 2048) throw io::InputError("pixels: expected 32 to 2048");
    }
    static void checked_count(const char* what, int value, int most) {
        if (value < 1 || value > most)
            throw io::InputError("{}: {} was given; expected 1 to {}", what, value, most);
    }
    std::optional<Flags> checked_mask(const py::object& given, const char* what) const {
        if (given.is_none()) return {};
        const auto any = array_given<py::array>(given);
        if (any && any.dtype().kind() == 'b' && any.ndim() == 1 && any.shape(0) == size()) return Flags(any);
        throw io::InputError("{}: {} was given; expected a mask, an array of {} truth values", what,
                             std::string(py::repr(given)), size());
    }
    episode::Camera& camera_of(Episode& episode, int thread) {
        return cameras_[static_cast<std::size_t>(thread)].of(episode, cache_);
    }
    episode::Camera* camera_of(Episode& episode) override { return &camera_of(episode, 0); }
    void forget() override {
        for (Cameras& cameras : cameras_) cameras.clear();
    }
    /// Calls work(index, thread) for each in [first, end). One call at a time, with the interpreter free.
    template <class Work>
    void in_parallel(int first, int end, const Work& work) {
        alone([&] {
            if (episodes_.empty()) throw_closed();
            pool_->run(end - first, [&](int i, int thread) { work(first + i, thread); });
        });
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
    struct Tracks {
        double *places = nullptr, *pixels = nullptr;
    };

    static void write(std::span<const Vec3> places, const render::CArm& arm, const Tracks& to,
                      std::ptrdiff_t row) {
        for (const Vec3& place : places) {
            const render::Pixel pixel = render::project(arm, place);
            std::copy_n(place.data(), 3, to.places + 3 * row);
            to.pixels[2 * row] = pixel.x;
            to.pixels[2 * row + 1] = pixel.y;
            ++row;
        }
    }
    static void checked_spacing(double spacing) {
        if (!(spacing > 0 && spacing <= 100))
            throw io::InputError("spacing_mm: {} was given; expected above 0 to 100", text_of(spacing));
    }

    void changed(int i) override {
        const Episode& episode = at(i);
        const exercise::Simulation& simulation = episode.simulation();
        const scenario::Scenario& scenario = simulation.scenario();
        readings_[i] = episode.reading();
        const render::CArm arm = episode.arm(scenario.c_arm.pixels);
        angles_[2 * i] = arm.lao / geometry::degree;
        angles_[2 * i + 1] = arm.cranial / geometry::degree;
        const Vec3 table = scenario.c_arm.isocentre - arm.isocentre;
        std::copy_n(table.data(), 3, shifts_ + 3 * static_cast<std::ptrdiff_t>(i));
        const Vec3 shift = simulation.vessel_shift();
        std::vector<Vec3> track(static_cast<std::size_t>(points_));
        std::vector<geometry::Polyline> paths;
        Vec3 introducer = Vec3::Zero();
        for (const scenario::PlacedDevice& placed : simulation.devices()) {
            paths.push_back(simulation.carried_path_of(placed.role));
            if (!paths.back().empty()) introducer = paths.back().front();
        }
        for (std::size_t k = 0; k < paths.size(); ++k) {
            if (paths[k].empty()) paths[k] = {introducer};  // it is out
            exercise::track(paths[k], spacing_, track);
            for (Vec3& x : track) x += shift;
            const std::ptrdiff_t of = static_cast<std::ptrdiff_t>(script::most_devices) * i + k;
            write(track, arm, of_devices_, of * points_);
            if (simulation.devices()[k].role == scenario.target.device)
                write(track, arm, of_target_, static_cast<std::ptrdiff_t>(i) * points_);
        }
    }

    std::optional<episode::Pool> pool_;
    std::vector<Cameras> cameras_;
    int points_ = 0;
    double spacing_ = 0;
    py::array records_;
    py::array_t<double> track_, track_px_, tracks_, tracks_px_, c_arm_, table_;
    Observation* readings_ = nullptr;
    Tracks of_target_, of_devices_;  // of the device that the exercise is about; of each
    double *angles_ = nullptr, *shifts_ = nullptr;
};

}  // namespace app
