"""What a worker process takes from itself before it reads a query, where the system has a way (Linux)."""

import ctypes
import platform
import struct
import sys
from typing import Final

_PR_SET_PDEATHSIG, _PR_SET_NO_NEW_PRIVS, _PR_SET_SECCOMP = 1, 38, 22
_SIGKILL: Final = 9
_MODE_FILTER: Final = 2
_ALLOW, _REFUSE_EPERM = 0x7FFF0000, 0x00050001
_LOAD_WORD, _IF_EQUAL, _RETURN = 0x20, 0x15, 0x06
_SYSCALLS: Final = {
    # machine: (audit architecture, socket, connect, execve)
    "x86_64": (0xC000003E, (41, 42, 59)),
    "aarch64": (0xC00000B7, (198, 203, 221)),
}


class _Program(ctypes.Structure):
    _fields_ = (("length", ctypes.c_ushort), ("filter", ctypes.c_void_p))


def confine(memory: int) -> bool:
    """Bound this process's memory, end it with its parent, and take the network from it.

    Parameters
    ----------
    memory : int
        Bytes it may allocate beyond what it has.

    Returns
    -------
    bool
        Whether the system now refuses it every new socket.
    """
    if sys.platform == "win32":
        return False
    import resource

    if sys.platform.startswith("linux"):
        limit = _data_bytes() + memory
        resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, _SIGKILL, 0, 0, 0)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        return _refuse_sockets()
    return False


def _data_bytes() -> int:
    with open("/proc/self/status", encoding="ascii") as status:  # noqa: PTH123 # a pseudo file
        return next(int(line.split()[1]) for line in status if line.startswith("VmData:")) * 1024


def _refuse_sockets() -> bool:
    """Install a seccomp filter: socket, connect and execve fail with EPERM."""
    if platform.machine() not in _SYSCALLS:
        return False
    architecture, refused = _SYSCALLS[platform.machine()]
    steps = [(_LOAD_WORD, 0, 0, 4), (_IF_EQUAL, 0, len(refused) + 2, architecture), (_LOAD_WORD, 0, 0, 0)]
    steps += [(_IF_EQUAL, len(refused) - at, 0, number) for at, number in enumerate(refused)]
    steps += [(_RETURN, 0, 0, _ALLOW), (_RETURN, 0, 0, _REFUSE_EPERM)]
    code = ctypes.create_string_buffer(b"".join(struct.pack("=HBBI", *step) for step in steps))
    program = _Program(len(steps), ctypes.addressof(code))
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.prctl(_PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0:
        return False
    return bool(libc.prctl(_PR_SET_SECCOMP, _MODE_FILTER, ctypes.byref(program), 0, 0) == 0)
