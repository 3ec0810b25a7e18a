/// The Python module seldinger._core: simulations one at a time and many at once, as NumPy arrays.

#include <chrono>
#include <filesystem>
#include <fmt/format.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>
#include <string>
#include <utility>
#include <vector>

#include "app/python/docs.h"
#include "app/python/episodes.h"
#include "app/python/free.h"
#include "app/python/values.h"
#include "app/python/views.h"
#include "engine/episode/episode.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/plan/plan.h"
#include "render/picture/png.h"

namespace app {
namespace {

/// A class whose methods and properties are Calls.
template <class T>
class Class : public py::class_<T> {
public:
    using py::class_<T>::class_;
    template <class Function, class... Extra>
    Class& def(const char* name, Function&& function, const Extra&... extra) {
        py::class_<T>::def(name, std::forward<Function>(function), py::call_guard<Call>(), extra...);
        return *this;
    }
    template <class Getter, class... Extra>
    Class& def_property_readonly(const char* name, Getter&& getter, const Extra&... extra) {
        py::class_<T>::def_property_readonly(
            name,
            py::cpp_function(py::method_adaptor<T>(std::forward<Getter>(getter)), py::call_guard<Call>()),
            py::return_value_policy::reference_internal, extra...);
        return *this;
    }
};

/// The method of the i-th as one of a simulation.
template <class Result, class... Arguments>
auto first(Result (Episodes::*method)(int, Arguments...)) {
    return [method](Simulation& s, Arguments... arguments) -> Result {
        return (s.*method)(0, std::forward<Arguments>(arguments)...);
    };
}

/// Objects of this class are made by __new__, not by __init__, so that none is used before it is made.
template <class T>
void whole_from_the_start(py::class_<T>& type) {
    type.def_static("__new__", [](const py::type& of, const py::args&, const py::kwargs&) {
        if (!PyType_IsSubtype(reinterpret_cast<PyTypeObject*>(of.ptr()),
                              reinterpret_cast<PyTypeObject*>(py::type::of<T>().ptr())))
            throw py::type_error("__new__: expected a class derived from " +
                                 std::string(py::str(py::type::of<T>().attr("__name__"))));
        auto made = py::reinterpret_steal<py::object>(
            py::detail::make_new_instance(reinterpret_cast<PyTypeObject*>(of.ptr())));
        auto* const instance = reinterpret_cast<py::detail::instance*>(made.ptr());
        py::detail::value_and_holder value =
            instance->get_value_and_holder(py::detail::get_type_info(typeid(T)));
        value.value_ptr() = new T();
        value.type->init_instance(instance, nullptr);
        return made;
    });
}

/// Objects of this class come from elsewhere.
template <class T>
void not_to_be_made(py::class_<T>& type, const char* why) {
    type.def_static("__new__",
                    [why](const py::args&, const py::kwargs&) -> py::object { throw py::type_error(why); });
}

std::vector<std::uint8_t> png_of(const py::object& given) {
    const auto any = array_given<py::array>(given);
    const char kind = any ? any.dtype().kind() : ' ';
    const bool colour = any && any.ndim() == 3 && any.shape(2) == 3;
    if (!any || !(kind == 'b' || (kind == 'u' && any.itemsize() == 1)) || !(any.ndim() == 2 || colour) ||
        any.size() == 0)
        throw io::InputError("image: " +
                             (any ? "an array of " + std::string(py::str(any.dtype())) + " and shape " +
                                        std::string(py::str(any.attr("shape")))
                                  : std::string(py::repr(py::type::of(given)))) +
                             " was given; expected one of uint8 or bool of shape (H, W) or (H, W, 3)");
    const py::array_t<std::uint8_t, py::array::c_style | py::array::forcecast> image(any);
    const auto height = static_cast<int>(image.shape(0)), width = static_cast<int>(image.shape(1));
    std::vector<std::uint8_t> pixels(image.data(), image.data() + image.size());
    if (kind == 'b')
        for (std::uint8_t& pixel : pixels) pixel = pixel != 0 ? 255 : 0;
    return colour ? render::encode_png(render::ColourImage{width, height, std::move(pixels)})
                  : render::encode_png(render::GrayImage{width, height, std::move(pixels)});
}

/// Plans of a scenario as JSON, ranked: what seldinger.plan() makes objects of.
std::vector<std::string> plans(const std::string& file, const std::optional<std::string>& text,
                               const std::string& devices, const std::string& to, const std::string& from,
                               const std::string& list, const std::string& exchange,
                               const std::string& patient, int threads, std::uint64_t seed, int restarts,
                               long frames, const std::optional<double>& time_limit,
                               const std::string& cache) {
    const auto begun = std::chrono::steady_clock::now();
    plan::PlanOptions options;
    options.search.threads = threads;
    options.search.seed = seed;
    options.search.restarts = restarts;
    options.search.most_frames = frames;
    options.cache.folder = cache;
    options.catalogue = devices;
    options.stop = [] {
        look_after_python();
        return false;
    };
    options.time_is_up = [&] {
        return time_limit &&
               std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count() > *time_limit;
    };
    std::vector<std::string> made;
    {
        const Free free;
        plan::CaseText usual = text ? plan::CaseText{*text, file} : plan::case_of(file, "glide035");
        usual =
            plan::with_ends(plan::with_patient(usual, patient, devices), to, from, devices, options.cache);
        const scenario::Scenario scenario = scenario::parse_scenario(usual.toml, usual.file, devices);
        options.search.wires = plan::wires_of(exchange, scenario, devices);
        std::vector<plan::Planned> all;
        for (const plan::Candidate& candidate : plan::candidates_of(list, scenario, devices))
            all.push_back(plan::plan(usual, candidate, options));
        plan::rank(all);
        plan::add_sensitivities(all, options);
        for (const plan::Planned& one : all) made.push_back(plan::to_json(one));
    }
    return made;
}

void write_png(const std::filesystem::path& path, const py::object& image) {
    const std::vector<std::uint8_t> bytes = png_of(image);
    io::write_whole(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace

PYBIND11_MODULE(_core, m) {
    m.doc() = "The engine of Seldinger. Use the package 'seldinger', which documents it.";
    m.attr("__version__") = SELDINGER_VERSION;
    py::register_exception<io::InputError>(m, "InputError", PyExc_ValueError).attr("__doc__") =
        docs::input_error;
    m.attr("InputError").attr("__module__") = "seldinger";

    Class<State> state(m, "State", docs::state);
    not_to_be_made(state, "State: expected a state of Simulation.step(), found one that was not made");
    py::list all, attributes;
    const auto list = [&all](std::string_view name, std::string_view column, const std::string& type,
                             const std::string& in_arrays, std::string_view unit, std::string_view doc) {
        all.append(py::make_tuple(std::string(name), std::string(column), type, in_arrays, std::string(unit),
                                  std::string(doc)));
    };
    for (const exercise::Field& field : exercise::fields()) {
        const Kind kind = kind_of(field);
        const std::string name(field.name);
        list(name, field.column, kind.attribute,
             kind.size == 1 ? "(n,) " + std::string(py::str(py::dtype(kind.format)))
             : kind.devices ? "(n, devices) float64"
                            : "(n, " + std::to_string(kind.size) + ") float64",
             field.unit, field.doc);
        if (name.empty()) continue;
        const std::string doc = described(kind.attribute, field.doc, field.unit);
        attributes.append(name);
        state.def_property_readonly(
            name.c_str(),
            [&field](const State& s) {
                return std::visit([&](const auto member) { return AsAttribute{s}(s.reading.*member); },
                                  field.member);
            },
            doc.c_str());
        if (!kind.devices) continue;
        const auto member = std::get<exercise::OfDevices Observation::*>(field.member);
        for (int k = 1; k < script::most_devices; ++k) {
            const auto role = static_cast<script::DeviceRole>(k);
            const std::string of_role = std::string(script::name_of(role)) + "_" + name;
            attributes.append(of_role);
            state.def_property_readonly(
                of_role.c_str(),
                [member, role](const State& s) {
                    const auto place = std::find(s.roles.begin(), s.roles.end(), role);
                    return place == s.roles.end()
                               ? 0.0
                               : (s.reading.*member).of[static_cast<std::size_t>(place - s.roles.begin())];
                },
                doc.c_str());
        }
    }
    for (std::size_t k = 0; k < episode::list_fields().size(); ++k) {
        const episode::ListField& field = episode::list_fields()[k];
        const std::string columns = field.columns == 1 ? "" : " " + std::to_string(field.columns);
        const std::string type = "(n," + columns + ") float64";
        list(field.name, "", type, "", field.unit, field.doc);
        attributes.append(std::string(field.name));
        state.def_property_readonly(
            std::string(field.name).c_str(), [k](const State& s) { return s.lists[k]; },
            described(type, field.doc, field.unit).c_str());
    }
    list("hash", "", "int", "", "", docs::hash);
    attributes.append("hash");
    state.def_readonly("hash", &State::hash, described("int", docs::hash, "").c_str());
    state.def(
        "asdict",
        [attributes](const py::object& s) {
            py::dict made;
            for (const py::handle name : attributes) made[name] = s.attr(name);
            return made;
        },
        docs::asdict);
    state.def("__repr__", [](const State& s) {
        return fmt::format(
            "<State of frame {}: {} with its tip at ({:.1f}, {:.1f}, {:.1f}) mm{}, {:.1f} mm "
            "from the target{}>",
            s.reading.frame, script::name_of(s.reading.device), s.reading.tip[0], s.reading.tip[1],
            s.reading.tip[2], s.branch.empty() ? "" : " in " + s.branch, s.reading.tip_to_target,
            s.reading.certified ? "" : ", not certified");
    });
    // name, trace's column, type in State, type in arrays, unit, description
    m.attr("_FIELDS") = all;
    m.attr("_RECORD") = record();
    py::list devices;
    for (const std::string_view name : script::device_names()) devices.append(std::string(name));
    m.attr("_DEVICES") = devices;

    Class<Snapshot> snapshot(m, "Snapshot", docs::snapshot);
    not_to_be_made(snapshot, "Snapshot: expected one of Simulation.snapshot(), found one that was not made");
    snapshot.def("__len__", [](const Snapshot& s) { return s.state.exercise.state.size(); });
    snapshot.def("__repr__", [](const Snapshot& s) {
        return fmt::format("<Snapshot of {} frames, {} bytes>", s.state.log.frames(),
                           s.state.exercise.state.size());
    });
    // For pickles.
    m.def(
        "_parts", [](const State& s) { return parts_of(s); }, py::call_guard<Call>());
    m.def(
        "_parts", [](const Snapshot& s) { return parts_of(s); }, py::call_guard<Call>());
    m.def(
        "_state", [](const py::tuple& parts) { return state_of(parts); }, py::call_guard<Call>());
    m.def("_snapshot", &snapshot_of, py::call_guard<Call>());

    Class<Simulation> one(m, "Simulation");
    whole_from_the_start(one);
    one.def("_open", &Simulation::open, py::arg("file"), py::arg("text"), py::arg("devices"),
            py::arg("overrides"), py::arg("images"), py::arg("cache"), py::arg("panel"))
        .def("step", &Simulation::step, py::arg("advance_mm") = 0.0, py::arg("rotate_deg") = 0.0,
             py::kw_only(), py::arg("device") = "wire", py::arg("catheter_advance_mm") = 0.0,
             py::arg("catheter_rotate_deg") = 0.0, py::arg("frames") = 1, docs::step)
        .def("apply", first(&Episodes::apply), py::arg("command"), docs::apply)
        .def_property_readonly("state", &Simulation::state, docs::state_now)
        .def("reset", &Simulation::reset, py::kw_only(), py::arg("target") = py::none(),
             py::arg("radius_mm") = py::none(), docs::reset)
        .def("snapshot", first(&Episodes::snapshot), docs::take_snapshot)
        .def(
            "restore",
            [](Simulation& s, const Snapshot& kept) {
                s.restore(0, kept);
                return s.state();
            },
            py::arg("snapshot"), docs::restore)
        .def("image", &Simulation::image, py::arg("pixels") = py::none(), py::arg("mode") = "live",
             py::kw_only(), py::arg("seed") = py::none(), docs::image)
        .def("panel", first(&Episodes::panel), py::arg("width") = 1280, py::arg("height") = 1024,
             py::kw_only(), py::arg("seed") = py::none(), docs::panel)
        .def("masks", &Simulation::masks, py::arg("pixels") = py::none(), docs::masks)
        .def("project", &Simulation::project, py::arg("places_mm"), py::arg("pixels") = py::none(),
             docs::project)
        .def("camera_matrix", &Simulation::camera_matrix, py::arg("pixels") = py::none(), docs::camera_matrix)
        .def("_score", first(&Episodes::score))
        .def("save", first(&Episodes::save), py::arg("path"), docs::save)
        .def("_open_like", &Simulation::open_like, py::arg("like"))
        .def("_target", first(&Episodes::target))
        .def("anatomy", &Simulation::anatomy, docs::anatomy)
        .def("about", &Simulation::about, docs::about)
        .def("path_from", first(&Episodes::path_length_from), py::arg("place_mm"), docs::path_from);

    Class<VectorSimulation> several(m, "VectorSimulation");
    whole_from_the_start(several);
    several
        .def("_open", &VectorSimulation::open, py::arg("like"), py::arg("n"), py::arg("threads"),
             py::arg("points"), py::arg("spacing_mm"))
        .def("__len__", &VectorSimulation::size)
        .def_property_readonly("threads", &VectorSimulation::threads, docs::threads)
        .def_property_readonly("_arrays", &VectorSimulation::arrays)
        .def("step", &VectorSimulation::step, py::arg("motions"), py::kw_only(), py::arg("frames") = 1,
             py::arg("active") = py::none(), docs::vector_step)
        .def("reset", &VectorSimulation::reset, py::arg("which") = py::none(), docs::vector_reset)
        .def("route", &VectorSimulation::route, py::arg("points"), py::arg("spacing_mm"), docs::route)
        .def("_assign", &VectorSimulation::assign, py::arg("i"), py::arg("like"))
        .def("aim", &VectorSimulation::aim, py::arg("i"), py::arg("target"),
             py::arg("radius_mm") = py::none(), docs::aim)
        .def("apply", &VectorSimulation::apply, py::arg("i"), py::arg("command"), docs::vector_apply)
        .def("hashes", &VectorSimulation::hashes, py::kw_only(), py::arg("asked") = false, docs::hashes)
        .def("show_tip", &VectorSimulation::show_tip, py::arg("i"),
             py::arg("margin") = episode::Episode::usual_margin, docs::show_tip)
        .def("_target", &VectorSimulation::target, py::arg("i"))
        .def("branch_name", &VectorSimulation::branch_name, py::arg("i"), docs::branch_name)
        .def("_score", &VectorSimulation::score, py::arg("i"))
        .def("save", &VectorSimulation::save, py::arg("i"), py::arg("path"), docs::vector_save)
        .def("path_from", &VectorSimulation::path_length_from, py::arg("i"), py::arg("place_mm"),
             docs::path_from)
        .def("snapshot", &VectorSimulation::snapshot, py::arg("i"), docs::take_snapshot)
        .def("restore", &VectorSimulation::restore, py::arg("i"), py::arg("snapshot"), docs::restore)
        .def("images", &VectorSimulation::images, py::arg("pixels"), py::arg("mode") = "live", py::kw_only(),
             py::arg("seeds") = py::none(), docs::images)
        .def("panel", &VectorSimulation::panel, py::arg("i"), py::arg("width") = 1280,
             py::arg("height") = 1024, py::kw_only(), py::arg("seed") = py::none(), docs::panel)
        .def("masks", &VectorSimulation::masks, py::arg("pixels"), docs::vector_masks);
    const auto closes = [](auto& type) {
        using Type = typename std::decay_t<decltype(type)>::type;
        type.def(
            "close", [](Type& e) { e.close(); }, docs::close);
        type.def_property_readonly(
            "closed", [](Type& e) { return e.closed(); }, docs::closed);
    };
    closes(one);
    closes(several);

    follow_python();

    m.def("_facts", &facts, py::arg("file"), py::arg("text"), py::arg("devices"), py::arg("overrides"),
          py::call_guard<Call>());
    m.def("_plan", &plans, py::arg("file"), py::arg("text"), py::arg("devices"), py::arg("to"),
          py::arg("from_"), py::arg("list"), py::arg("exchange"), py::arg("patient"), py::arg("threads"),
          py::arg("seed"), py::arg("restarts"), py::arg("frames"), py::arg("time_limit_s"), py::arg("cache"),
          py::call_guard<Call>());
    m.def(
        "_views",
        [](const std::string& file, const std::optional<std::string>& text, const std::string& catalogue,
           const Overrides& overrides, const std::string& cache, const std::optional<std::string>& branch,
           const std::optional<double>& from, const std::optional<double>& to, const std::string& side,
           const std::string& contrast, double step, double apart) {
            return views(file, text, catalogue, overrides, cache,
                         {branch, from, to, side, contrast, step, apart});
        },
        py::arg("file"), py::arg("text"), py::arg("devices"), py::arg("overrides"), py::arg("cache"),
        py::arg("branch"), py::arg("from_mm"), py::arg("to_mm"), py::arg("side"), py::arg("contrast"),
        py::arg("step_deg"), py::arg("apart_deg"), py::call_guard<Call>());
    m.def("write_png", &write_png, py::arg("path"), py::arg("image"), docs::write_png,
          py::call_guard<Call>());
    m.def(
        "_png", [](const py::object& image) { return bytes_of(png_of(image)); }, py::call_guard<Call>());
}

}  // namespace app
