// Base of the interfaces.
#pragma once

namespace tricoil {

/// Not copyable; an implementation may be deleted through its interface.
class Interface {
public:
    Interface() = default;
    Interface(const Interface&) = delete;
    Interface& operator=(const Interface&) = delete;
    virtual ~Interface() = default;
};

}  // namespace tricoil
