#include <fmt/format.h>

#include <memory>

#include "board/host/commands/serve_command.hpp"
#include "board/host/serve/access.hpp"
#include "board/host/serve/button_input.hpp"
#include "board/host/serve/fastrak/fastrak_output.hpp"
#include "board/host/serve/tcp_service.hpp"
#include "board/host/serve/udp_service.hpp"
#include "board/host/serve/validity_log.hpp"
#include "board/linux/device_config.hpp"
#include "board/linux/text_name.hpp"
#include "board/support/errors.hpp"
#include "board/support/output_file.hpp"
#include "board/support/service_notice.hpp"
#include "board/support/terminal_text.hpp"
#ifdef TRICOIL_WITH_OPENIGTLINK
#include "board/host/serve/openigtlink/igtl_session.hpp"
#endif
#ifdef TRICOIL_WITH_OSC
#include "board/pose_text/osc/osc_bundle.hpp"
#endif
#ifdef TRICOIL_WITH_WEB
#include "board/host/serve/web/page_output.hpp"
#include "board/host/serve/websocket/session.hpp"
#endif

namespace tricoil::host {
namespace {

using Addresses = nlohmann::ordered_json;

Access access_of(const ServeCommand& command) {
    refuse_if(command.open_controls && command.read_only, "--open-controls and --read-only exclude each other");
    Access access{Controls::by_token, new_token(), command.names};
    access.controls = command.read_only ? Controls::none : command.open_controls ? Controls::open : Controls::by_token;
    return access;
}

constexpr const char* kReadPoses = "read poses";

const char* can_do(Controls controls) {
    return controls == Controls::open ? "read poses, switch the coils, set the hemisphere and record" : kReadPoses;
}

/// Adds a server for clients without controls. Returns its port.
template <typename Session>
int add_tcp(const char* option, const TcpAddress& address, Server& server, typename TcpService<Session>::Factory factory,
            const StreamLimits& limits = {}) {
    auto service = std::make_unique<TcpService<Session>>(option, address, std::move(factory), limits);
    warn_of_exposure(option, address, kReadPoses);  // its clients have no controls
    const int port = service->port();
    server.add(std::move(service));
    return port;
}

#ifdef TRICOIL_WITH_OPENIGTLINK
void add_openigtlink(const ServeCommand& command, Server& server, Addresses& addresses) {
    constexpr const char* kOption = "--openigtlink";
    const igtl_output::DeviceNames names(command.igtl_names, "--igtl-name");
    if (command.openigtlink.empty()) {
        refuse_if(!command.igtl_names.empty(), "--igtl-name: only with --openigtlink");
        return;
    }
    const TcpAddress address = parse_tcp_address(kOption, command.openigtlink);
    const int port = add_tcp<igtl_output::Session>(kOption, address, server, [&server, names](Stream& stream) {
        auto session = std::make_unique<igtl_output::Session>(stream, names);
        session->set_newest(server.hub().newest());
        return session;
    });
    addresses["openigtlink"] = address.text(port);
}
#else
void add_openigtlink(const ServeCommand&, Server&, Addresses&) {}
#endif

#ifdef TRICOIL_WITH_WEB
void add_websocket(const ServeCommand& command, const PoseUnits& units, Server& server, Addresses& addresses) {
    constexpr const char* kOption = "--websocket";
    for (const std::string& origin : command.origins) {
        websocket::check_origin(origin);
    }
    if (command.websocket.empty()) {
        refuse_if(!command.origins.empty(), "--allow-origin: only with --websocket");
        return;
    }
    const TcpAddress address = parse_tcp_address(kOption, command.websocket);
    const int port = add_tcp<websocket::Session>(
        kOption, address, server,
        [&command, units](Stream& stream) { return std::make_unique<websocket::Session>(stream, command.origins, units); },
        websocket::kLimits);
    addresses["websocket"] = fmt::format("ws://{}/", address.shown().text(port));
}
#else
void add_websocket(const ServeCommand&, const PoseUnits&, Server&, Addresses&) {}
#endif

/// Prints a warning that poses leave this machine.
void warn_of_sending(const char* option, const TcpAddress& address, const std::string& where) {
    if (!address.is_loopback()) {
        print_notice("tricoil: {} {}: poses are sent over the network without encryption\n", option, where);
    }
}

#ifdef TRICOIL_WITH_OSC
void add_osc(const ServeCommand& command, Server& server, Addresses& addresses) {
    constexpr const char* kOption = "--osc";
    for (const std::string& where : command.osc) {
        const TcpAddress address = parse_tcp_address(kOption, where);
        const std::string text = address.text(std::stoi(address.port));
        server.add(std::make_unique<UdpService>(fmt::format("{} {}", kOption, text), address, osc_bundle));
        warn_of_sending(kOption, address, where);
        addresses["osc"].push_back(text);
    }
}
#else
void add_osc(const ServeCommand&, Server&, Addresses&) {}
#endif

void add_button(const ServeCommand& command, Server& server) {
    if (command.button.empty()) {
        return;
    }
    refuse_if(command.fastrak.empty(), "--button: only with --fastrak");
    const std::string device = is_on_device(*command.run) ? device_options(*command.run).config.device : "";
    refuse_if(command.button == "-" && linux_board::is_text_source(device) && linux_board::parse_text_name(device).where == "-",
              "--button - and --device exclude each other: both read standard input");
    server.add(std::make_unique<ButtonInput>(command.button, server.button()));
}

#ifdef TRICOIL_WITH_WEB
/// Writes the link with the token to a file that only the user can read, or prints it with the addresses. It is never logged.
void publish_link(const ServeCommand& command, const std::string& link, Addresses& addresses) {
    if (command.open_controls || command.read_only) {
        return;
    }
    if (!command.token_file.empty()) {
        write_private_file(command.token_file, link + "\n");
    } else if (writes_to_journal()) {
        print_notice("tricoil: the link for controls is not written to the journal; use --token-file FILE\n");
    } else {
        addresses["web_controls"] = link;
    }
}

void add_page(const ServeCommand& command, const Access& access, Server& server, TrackerControl& control,
              RecordingSwitch& recordings, Addresses& addresses) {
    if (command.web.empty()) {
        return;
    }
    const TcpAddress address = parse_tcp_address("--web", command.web);
    auto page = web::make_output(address, access, server.hub(), control, recordings, server.button());
    server.add_apart(std::move(page.service));
    warn_of_exposure("--web", address, can_do(access.controls));
    addresses["web"] = page.url;
    publish_link(command, page.control_url, addresses);
}
#else
void add_page(const ServeCommand&, const Access&, Server&, TrackerControl&, RecordingSwitch&, Addresses&) {}
#endif

}  // namespace

ServeOutputs open_outputs(const ServeCommand& command, const PoseUnits& units, Server& server, TrackerControl& control,
                          RecordingSwitch& recordings) {
    const Access access = access_of(command);
    ServeOutputs outputs;
    for (const std::string& where : command.fastrak) {
        auto output =
            fastrak::make_output(where, command.fastrak_continuous, access.controls, server.hub(), control, server.button());
        if (where.starts_with("tcp:")) {
            warn_of_exposure("--fastrak", parse_tcp_address("--fastrak", where.substr(4)), can_do(access.controls));
        }
        outputs.addresses["fastrak"].push_back(output.address);
        server.add(std::move(output.service));
    }
    for (const std::string& where : command.json_lines) {
        if (where == kStandardOutput) {
            if (outputs.to_standard_output != nullptr) {
                throw InputError("--json-lines -: given twice; standard output can have the poses once");
            }
            auto sender = std::make_unique<json_lines::StdoutSender>(units);
            outputs.to_standard_output = sender.get();
            server.add(std::move(sender));
            continue;
        }
        auto output = json_lines::make_output(where, units);
        if (where.starts_with("tcp:")) {
            warn_of_exposure("--json-lines", output.address, kReadPoses);
        } else {
            warn_of_sending("--json-lines", output.address, where);
        }
        outputs.addresses["json_lines"].push_back(output.text);
        server.add(std::move(output.service));
    }
    add_openigtlink(command, server, outputs.addresses);
    add_websocket(command, units, server, outputs.addresses);
    add_osc(command, server, outputs.addresses);
    add_button(command, server);
    add_page(command, access, server, control, recordings, outputs.addresses);
    refuse_if(outputs.addresses.empty() && outputs.to_standard_output == nullptr,
              "serve: no output; add --fastrak, --openigtlink, --json-lines, --websocket, --osc or --web");
    refuse_if(outputs.to_standard_output != nullptr && command.run->json,
              "--json-lines - and --json exclude each other: both write to standard output");
    server.add(std::make_unique<ValidityLog>());
    return outputs;
}

void announce(const ServeOutputs& outputs, bool json) {
    std::string text = json ? outputs.addresses.dump() + "\n" : "";
    for (const auto& [name, address] : outputs.addresses.items()) {
        if (!json) {
            text += fmt::format("serving {} on {}\n", name,
                                address.is_array() ? fmt::format("{}", fmt::join(address.get<std::vector<std::string>>(), ", "))
                                                   : address.get<std::string>());
        }
    }
    outputs.to_standard_output != nullptr ? print_notice(text) : print_text(text);
    std::fflush(stdout);
}

}  // namespace tricoil::host
