#include "board/support/sim_input/metal_text.hpp"

#include <algorithm>
#include <cmath>

#include "board/support/errors.hpp"
#include "board/support/text_table.hpp"

namespace tricoil::host {
namespace {

constexpr double kFarthest_m = 1000;

double read_size(CheckedTable& table, const std::string& key) {
    table.demand(table.has(key), key, "is missing");
    const double size_m = table.number(key, 0);
    table.demand(size_m > 0 && size_m <= sim::kGreatestMetalSize_m, key, "must be a positive length, at most 10 m");
    return size_m;
}

Vec3<double> read_place(CheckedTable& table, const std::string& key, const Vec3<double>& fallback) {
    const Vec3<double> place = table.vector(key, fallback);
    table.demand(place.cwiseAbs().maxCoeff() <= kFarthest_m, key, "must lie within 1000 m");
    return place;
}

sim::Material named_material(CheckedTable& table) {
    std::vector<std::string> names;
    for (const sim::NamedMaterial& material : sim::materials()) {
        names.emplace_back(material.name);
    }
    const std::string name = table.choice("material", names);
    const auto is_it = [&](const sim::NamedMaterial& material) { return material.name == name; };
    return std::find_if(sim::materials().begin(), sim::materials().end(), is_it)->material;
}

/// A preset; its values can be replaced. A conductivity without a preset is a non-magnetic metal.
sim::Material read_material(CheckedTable& table) {
    const bool is_own = table.has("conductivity_s_m");
    sim::Material material;
    if (!is_own || table.has("material")) {
        material = named_material(table);
    }
    material.conductivity_s_m = table.number("conductivity_s_m", material.conductivity_s_m);
    table.demand(material.conductivity_s_m > 0 && material.conductivity_s_m <= sim::kGreatestConductivity_s_m, "conductivity_s_m",
                 "must be positive, at most 1e8 S/m (copper: 5.96e7)");
    if (table.has("relative_permeability")) {
        const double permeability = table.number("relative_permeability", 1);
        table.demand(permeability >= 1 && permeability <= sim::kGreatestPermeability, "relative_permeability",
                     "must be 1 to 1e6");
        material.permeability_low = material.permeability_high = permeability;
    }
    return material;
}

sim::MetalShape read_shape(CheckedTable& table) {
    const std::string name = table.choice("shape", {"sphere", "rod", "tube", "sheet"});
    if (name == "sphere") {
        return sim::Sphere{read_size(table, "radius_m")};
    }
    if (name == "sheet") {
        const sim::Sheet sheet{read_size(table, "width_m"), read_size(table, "height_m"), read_size(table, "thickness_m")};
        const double shorter = std::min(sheet.width_m, sheet.height_m);
        table.demand(5 * sheet.thickness_m <= shorter, "thickness_m", "must be at most a fifth of width and height");
        table.demand(std::max(sheet.width_m, sheet.height_m) <= 10 * shorter, "width_m",
                     "and 'height_m' differ by more than a factor of 10");
        return sheet;
    }
    sim::Cylinder cylinder{read_size(table, "diameter_m"), read_size(table, "length_m"), 0};
    table.demand(cylinder.length_m >= cylinder.diameter_m, "length_m", "must be at least the diameter");
    if (name == "tube") {
        cylinder.wall_m = read_size(table, "wall_m");
        table.demand(2 * cylinder.wall_m < cylinder.diameter_m, "wall_m", "must be less than half the diameter");
    }
    return cylinder;
}

/// Turns the z axis (of a rod, of a sheet's normal) to `axis`, and the x axis (a sheet's width) towards `edge`.
Quat<double> read_attitude(CheckedTable& table) {
    const Vec3<double> z = table.vector("axis", Vec3<double>::UnitZ());
    table.demand(z.norm() > 0, "axis", "must not be zero");
    Eigen::Index least = 0;
    z.cwiseAbs().minCoeff(&least);
    const Vec3<double> edge = table.vector("edge", Vec3<double>::Unit(least));
    const Vec3<double> y = z.normalized().cross(edge);
    table.demand(y.norm() > 1e-6 * edge.norm(), "edge", "must not be zero or along the axis");
    Mat3<double> turn;
    turn.col(2) = z.normalized();
    turn.col(1) = y.normalized();
    turn.col(0) = turn.col(1).cross(turn.col(2));
    return Quat<double>(turn);
}

void read_path(CheckedTable& table, sim::MetalObject& object) {
    object.far_m = read_place(table, "to_m", object.pose.position_m);
    object.speed_m_s = table.number("speed_m_s", 0);
    table.demand(object.speed_m_s >= 0 && object.speed_m_s <= sim::kGreatestMetalSpeed_m_s, "speed_m_s", "must be 0 to 100");
    table.demand(table.has("to_m") == table.has("speed_m_s"), "speed_m_s", "and 'to_m' belong together");
    object.turn_rad_s = table.vector("turn_rad_s", Vec3<double>::Zero());
}

/// KEY=VALUE as a TOML value: a text, a number, or numbers separated by '/'.
void insert_argument(toml::table& table, const std::string& argument, const std::string& text) {
    const auto equals = argument.find('=');
    if (equals == std::string::npos) {
        throw InputError("fault '" + text + "': '" + argument + "' is not KEY=VALUE, as radius_m=0.05");
    }
    const std::string key = argument.substr(0, equals);
    const std::string value = argument.substr(equals + 1);
    if (table.contains(key)) {
        throw InputError("fault '" + text + "': '" + key + "' is given twice");
    }
    if (key == "material") {
        table.insert(key, value);
        return;
    }
    toml::array numbers;
    for (const auto field : split(value, '/')) {
        try {
            numbers.push_back(parse_number(field, {"fault", 1}));
        } catch (const InputError&) {
            throw InputError("fault '" + text + "': '" + std::string(field) + "' of '" + key + "' is not a number");
        }
    }
    if (numbers.size() == 1) {
        table.insert(key, *numbers[0].value<double>());
    } else {
        table.insert(key, numbers);
    }
}

/// True if an argument can only be one of X,Y,Z,RADIUS.
bool is_short_form(const std::string& first) {
    return first.empty() || first.find_first_not_of("+-.0123456789e") == std::string::npos;
}

toml::table table_of(const std::vector<std::string>& arguments, const std::string& text) {
    toml::table table;
    if (arguments.empty() || !is_short_form(arguments[0])) {
        table.insert("shape", arguments.empty() ? "" : arguments[0]);
        for (std::size_t i = 1; i < arguments.size(); ++i) {
            insert_argument(table, arguments[i], text);
        }
        return table;
    }
    if (arguments.size() != 4) {
        throw InputError("fault '" + text + "': give x,y,z,radius in metres, or a shape and its keys");
    }
    table.insert("shape", "sphere");
    insert_argument(table, "material=aluminium", text);
    insert_argument(table, "position_m=" + arguments[0] + "/" + arguments[1] + "/" + arguments[2], text);
    insert_argument(table, "radius_m=" + arguments[3], text);
    return table;
}

}  // namespace

sim::MetalObject read_metal(CheckedTable& table) {
    sim::MetalObject object;
    object.shape = read_shape(table);
    object.material = read_material(table);
    table.demand(table.has("position_m"), "position_m", "is missing");
    object.pose.position_m = read_place(table, "position_m", Vec3<double>::Zero());
    object.pose.q_source_sensor = read_attitude(table);
    read_path(table, object);
    return object;
}

sim::MetalObject parse_metal(const std::vector<std::string>& arguments, const std::string& text) {
    const toml::table fields = table_of(arguments, text);
    CheckedTable table("fault '" + text + "'", "", fields);
    sim::MetalObject object = read_metal(table);
    table.finish();
    return object;
}

}  // namespace tricoil::host
