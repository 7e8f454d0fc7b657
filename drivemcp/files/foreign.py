"""What a file is that is not what its name says: empty, a pointer of Git LFS, or a web page."""


def foreign(head: bytes, wanted: str, *, xml: bool = False) -> str:
    """In words, with what to do, by the beginning of a file that should be a `wanted`; empty where it may be one.

    `xml`: a `wanted` may be XML itself.
    """
    head = head.lstrip()[:64].lower()
    if not head:
        return "it is empty; was a download broken off? Fetch it again"
    if head.startswith(b"version https://git-lfs"):
        return f"it is a pointer of Git LFS and not the {wanted}: git lfs pull"
    if head.startswith((b"<!doctype html", b"<html") if xml else b"<"):
        return f"it is a page and not a {wanted}: was a download answered by a web page?"
    return ""
