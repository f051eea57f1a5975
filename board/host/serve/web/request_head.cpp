#include "board/host/serve/web/request_head.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

namespace tricoil::host::web {
namespace {

constexpr std::size_t kLongestTarget = 256;
constexpr std::string_view kLineEnd = "\r\n";

RequestHead refuse(int status, std::string reason) { return {status, std::move(reason), {}}; }

bool is_visible(char c) { return c > ' ' && c <= '~'; }
bool is_text(char c) { return c >= ' ' && c <= '~'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// RFC 9110, 5.6.2.
bool is_token(std::string_view name) {
    return !name.empty() && std::all_of(name.begin(), name.end(), [](char c) {
        return is_visible(c) && std::string_view("()<>@,;:\\\"/[]?={}").find(c) == std::string_view::npos;
    });
}

std::string lower(std::string_view text) {
    std::string result(text);
    std::transform(result.begin(), result.end(), result.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return result;
}

std::string_view trim(std::string_view text) {
    while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) {
        text.remove_prefix(1);
    }
    while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) {
        text.remove_suffix(1);
    }
    return text;
}

/// Removes the first line from `rest` and returns it.
std::string_view take_line(std::string_view& rest) {
    const auto end = std::min(rest.find(kLineEnd), rest.size());
    const std::string_view line = rest.substr(0, end);
    rest.remove_prefix(std::min(end + kLineEnd.size(), rest.size()));
    return line;
}

/// Checks a line such as "GET /path HTTP/1.1" and sets `method`.
RequestHead reduced_request_line(std::string_view line, std::string_view& method) {
    const auto first = line.find(' ');
    const auto last = line.rfind(' ');
    if (first == std::string_view::npos || first == last) {
        return refuse(400, "the request line is malformed");
    }
    method = line.substr(0, first);
    const std::string_view target = line.substr(first + 1, last - first - 1);
    const std::string_view version = line.substr(last + 1);
    if (version != "HTTP/1.1" && version != "HTTP/1.0") {
        return refuse(505, "only HTTP/1.0 and HTTP/1.1 are supported");
    }
    if (method != "GET" && method != "HEAD" && method != "POST") {
        return refuse(405, "only GET, HEAD and POST are supported");
    }
    if (target.size() > kLongestTarget) {
        return refuse(414, "the path is too long");
    }
    if (!target.starts_with('/') || !std::all_of(target.begin(), target.end(), is_visible)) {
        return refuse(400, "the path is malformed");
    }
    return {0, {}, fmt::format("{} {} {}\r\n", method, target, version)};
}

}  // namespace

RequestHead reduced_head(std::string_view received, std::span<const HeadField> fields) {
    std::string_view rest = received;
    std::string_view method;
    RequestHead head = reduced_request_line(take_line(rest), method);
    std::vector<bool> seen(fields.size());
    bool has_length = false;
    for (std::string_view line = take_line(rest); head.refusal == 0 && !line.empty(); line = take_line(rest)) {
        const auto colon = std::min(line.find(':'), line.size());
        const std::string name = lower(line.substr(0, colon));
        const std::string_view value = trim(line.substr(std::min(colon + 1, line.size())));
        if (colon == line.size() || !is_token(name)) {
            return refuse(400, "a header field is malformed");
        }
        if (name == "transfer-encoding") {
            return refuse(501, "transfer encodings are not supported");
        }
        const auto field = std::find_if(fields.begin(), fields.end(), [&](const HeadField& f) { return f.name == name; });
        if (field == fields.end() || (field->for_post_only && method != "POST")) {
            continue;
        }
        if (!std::all_of(value.begin(), value.end(), is_text)) {
            return refuse(400, fmt::format("{} contains a character that is not printable ASCII", field->name));
        }
        if (field->name == "content-length" &&
            (value.empty() || value.size() > 6 || !std::all_of(value.begin(), value.end(), is_digit))) {
            return refuse(400, "Content-Length is malformed");
        }
        const auto place = static_cast<std::size_t>(field - fields.begin());
        if (seen[place]) {
            return refuse(400, fmt::format("{} is given twice", field->name));
        }
        seen[place] = true;
        has_length = has_length || field->name == "content-length";
        if (field->name == "content-type" && value != "application/json") {
            continue;  // the library would parse a form
        }
        head.text += fmt::format("{}: {}\r\n", field->name, value);
    }
    if (head.refusal == 0 && method == "POST" && !has_length) {
        return refuse(411, "Content-Length is missing");
    }
    head.text += head.refusal == 0 ? kLineEnd : "";
    return head;
}

std::string_view value_of(std::string_view reduced, std::string_view name) {
    const std::string begin = fmt::format("{}{}: ", kLineEnd, name);
    const auto at = reduced.find(begin);
    return at == std::string_view::npos ? std::string_view() : take_line(reduced = reduced.substr(at + begin.size()));
}

bool is_from_other_page(std::string_view fetch_site) {
    return !fetch_site.empty() && fetch_site != "same-origin" && fetch_site != "none";  // none: the user entered the address
}

std::string refusal_answer(const RequestHead& head, std::string_view further_fields) {
    const std::string body = nlohmann::json{{"answer", head.reason}}.dump();
    return fmt::format(
        "HTTP/1.1 {} Refused\r\nContent-Type: application/json\r\nContent-Length: {}\r\nConnection: close\r\n{}\r\n{}",
        head.refusal, body.size(), further_fields, body);
}

}  // namespace tricoil::host::web
